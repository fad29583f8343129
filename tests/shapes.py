"""Checks of the shapes of arrays at every call of the package, while it is tested."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, get_args

from beartype import BeartypeConf, beartype

_CONF = BeartypeConf(is_pep484_tower=True)


def checked(function: Callable[..., Any]) -> Callable[..., Any]:
    """Check those annotations that hold arrays; mypy checks the others, and some cannot be checked while running."""
    function.__annotations__ = {
        name: hint
        for name, hint in function.__annotations__.items()
        if "[ndarray, " in repr(hint) and not any(getattr(one, "_is_protocol", False) for one in get_args(hint))
    }
    return beartype(function, conf=_CONF) if function.__annotations__ else function
