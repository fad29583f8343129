"""Which cases of a test `make test` runs, and which are left to `make slow`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def thinned(cases: Iterable[Any], every: int = 2) -> list[Any]:
    """Every n-th case, from the first on, for `make test`; the others bear the mark slow."""
    return [
        pytest.param(*(case if isinstance(case, tuple) else (case,)), marks=pytest.mark.slow if at % every else ())
        for at, case in enumerate(cases)
    ]
