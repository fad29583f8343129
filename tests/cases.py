"""Which cases of a test `make test` runs, and which are left to `make slow`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def thinned(cases: Iterable[Any], every: int = 2) -> list[Any]:
    """Every n-th case, from the first on, for `make test`; the others bear the mark slow."""
    return [case if at % every == 0 else left_to_slow(case) for at, case in enumerate(cases)]


def left_to_slow(case: Any) -> Any:
    """A case, or what `pytest.param` made of it, with the mark slow."""
    if hasattr(case, "marks"):
        return pytest.param(*case.values, marks=(*case.marks, pytest.mark.slow), id=case.id)
    return pytest.param(*(case if isinstance(case, tuple) else (case,)), marks=pytest.mark.slow)
