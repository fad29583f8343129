"""What a folder of the package holds: a file adds a thing, and nothing else has to name it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib import import_module
from inspect import isabstract
from pkgutil import iter_modules
from types import ModuleType
from typing import TypeVar

T = TypeVar("T")


def files_in(folder: ModuleType) -> list[ModuleType]:
    """The modules of a folder, in the order of their names."""
    return [import_module(f"{folder.__name__}.{file.name}") for file in iter_modules(folder.__path__)]


def made_in(folder: ModuleType, base: Callable[[], T]) -> list[T]:
    """One of each class derived from `base` that the files of a folder define, in the order of the files' names."""
    return [kind() for file in files_in(folder) for kind in _own(file, base)]


def _own(file: ModuleType, base: Callable[[], T]) -> Iterator[type[T]]:
    assert isinstance(base, type)
    for kind in vars(file).values():
        own = isinstance(kind, type) and kind.__module__ == file.__name__
        if own and issubclass(kind, base) and not isabstract(kind):
            yield kind
