"""Modules of a folder of the package: those that each add a thing, and names loaded at first use."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from importlib import import_module
from inspect import isabstract
from pkgutil import iter_modules
from types import ModuleType
from typing import Any, TypeVar

T = TypeVar("T")


def files_in(folder: ModuleType) -> list[ModuleType]:
    """Import the modules of a package, in alphabetical order."""
    return [import_module(f"{folder.__name__}.{file.name}") for file in iter_modules(folder.__path__)]


def instances_of(base: Callable[[], T], files: Iterable[ModuleType]) -> list[T]:
    """Instantiate each class derived from `base` that modules define, in their order."""
    kind_of: Any = base
    return [
        kind()
        for file in files
        for kind in vars(file).values()
        if isinstance(kind, type)
        and kind.__module__ == file.__name__
        and issubclass(kind, kind_of)
        and not isabstract(kind)
    ]


def lazy_import(names: dict[str, Any], homes: Mapping[str, str]) -> Callable[[str], Any]:
    """Return the `__getattr__` of a package that imports its names on first use (PEP 562).

    `homes`: name -> module that defines it.
    """

    def loaded(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {names['__name__']!r} has no attribute {name!r}")
        names[name] = getattr(import_module(homes[name], names["__name__"]), name)
        return names[name]

    return loaded
