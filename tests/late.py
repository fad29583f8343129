"""Libraries that are imported by the first test that needs them, as they take long."""

from __future__ import annotations

from importlib import import_module
from typing import Any


class Late:
    """A module, imported when something of it is used."""

    def __init__(self, name: str) -> None:
        self._late = name

    def __getattr__(self, name: str) -> Any:
        if name.startswith(("_", "pytest")):  # pytest asks each name of a module what it is
            raise AttributeError(name)
        return getattr(import_module(self._late), name)
