"""Checks of the types of arguments and results, arrays with their shapes, at every call of the package."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Self, get_args

from beartype import BeartypeConf, beartype

_CONF = BeartypeConf(is_pep484_tower=True)
"""A whole number is a float, too, as for mypy."""


def checked(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that checks its types at each call; what only mypy can check is left to it."""
    for name, hint in list(function.__annotations__.items()):
        if _is_for_mypy(hint):
            del function.__annotations__[name]
    return beartype(function, conf=_CONF)


def _is_for_mypy(hint: Any) -> bool:
    return hint is Self or getattr(hint, "_is_protocol", False) or any(map(_is_for_mypy, get_args(hint)))
