"""Checks of the types of arguments and results, arrays with their shapes, of calls of the package."""

from __future__ import annotations

import ast
import inspect
import sys
from collections.abc import Sequence
from dataclasses import is_dataclass
from functools import partial, wraps
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from importlib.util import cache_from_source
from types import CodeType, FunctionType, ModuleType
from typing import Any, Self, get_args, get_type_hints
from unittest import mock

from beartype import BeartypeConf, beartype
from jaxtyping import AbstractArray, jaxtyped

_CONF = BeartypeConf(is_pep484_tower=True)
"""A whole number is a float, too, as for mypy."""
_MARK = "__checked_types__"
Function = Any
"""A function, also one that beartype or jaxtyping made."""


def check_types(modules: set[str]) -> None:
    """From now on, imports of these modules check the types of every call."""
    sys.meta_path.insert(0, _Finder(modules))


def checked(made: Any) -> Any:
    """Return a function or dataclass that checks its types; what only mypy can check is left to it."""
    if isinstance(made, type):
        if is_dataclass(made) and "__init__" in vars(made):
            made.__init__ = checked(made.__init__)  # type: ignore[misc]
        return made
    if inspect.isgeneratorfunction(made):
        return jaxtyped(made, typechecker=_of_types)
    key = made.__module__, made.__qualname__, made.__code__
    if key in _MADE:
        found = _of_another(made, *_MADE[key])
    else:
        made.__annotations__ = {name: _told(hint, made.__globals__) for name, hint in made.__annotations__.items()}
        found = _of_types(made)
        _MADE[key] = made, found
    if not any(map(_has_array, _MADE[key][0].__annotations__.values())):
        return found  # jaxtyping takes ten times as long as the check, and would have no shapes to compare

    calls = _CALLS.setdefault(key, [0])

    @wraps(made)
    def of_one_call(*arguments: Any, **named: Any) -> Any:
        calls[0] += 1
        if calls[0] > _ALL_OF and calls[0] % _ALL_OF:
            return made(*arguments, **named)
        with jaxtyped("context"):
            return found(*arguments, **named)

    return of_one_call


_CALLS: dict[Any, list[int]] = {}
"""How often each function with arrays was called."""
_ALL_OF = 20
"""Calls of a function with arrays that are all checked; then every 20th is, since a check takes longer than most calls."""
_MADE: dict[Any, tuple[Function, Function]] = {}
"""Functions that check, and what they call, by where these stand; one inside of another is made again and again."""


def _of_another(made: Function, first: Function, found: Function) -> Function:
    """What checks the first closure of a function, with another closure."""
    if found is first:
        return made
    again = FunctionType(found.__code__, found.__globals__, found.__name__, found.__defaults__)
    assert first in found.__kwdefaults__.values()  # where beartype keeps it
    again.__kwdefaults__ = {name: made if one is first else one for name, one in found.__kwdefaults__.items()}
    return wraps(made)(again)


def _of_types(made: Function) -> Function:
    for name, hint in list(made.__annotations__.items()):
        if _is_for_mypy(hint):
            del made.__annotations__[name]
    return beartype(made, conf=_CONF)


def _told(hint: Any, names: dict[str, Any]) -> Any:
    """A hint that may be text; of what is imported for mypy alone, nothing is known."""

    def probe() -> None: ...

    probe.__annotations__ = {"hint": hint}
    try:
        return get_type_hints(probe, names, include_extras=True)["hint"]
    except (NameError, TypeError):
        return Any


def _has_array(hint: Any) -> bool:
    return (isinstance(hint, type) and issubclass(hint, AbstractArray)) or any(map(_has_array, get_args(hint)))


def _is_for_mypy(hint: Any) -> bool:
    return hint is Self or getattr(hint, "_is_protocol", False) or any(map(_is_for_mypy, get_args(hint)))


class _Marker(ast.NodeVisitor):
    """Decorates functions before all else, and classes after it."""

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        node.decorator_list.append(ast.copy_location(ast.Name(_MARK, ast.Load()), node))
        self.generic_visit(node)

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        node.decorator_list.insert(0, ast.copy_location(ast.Name(_MARK, ast.Load()), node))
        self.generic_visit(node)


class _Loader(SourceFileLoader):
    def get_code(self, fullname: str) -> CodeType | None:
        kept_apart = partial(cache_from_source, optimization="checked")
        with mock.patch("importlib._bootstrap_external.cache_from_source", kept_apart):
            return super().get_code(fullname)

    def source_to_code(self, data: Any, path: Any, *, _optimize: int = -1) -> CodeType:  # type: ignore[override]
        tree = ast.parse(data, path)
        _Marker().visit(tree)
        return compile(tree, path, "exec", dont_inherit=True, optimize=_optimize)

    def exec_module(self, module: ModuleType) -> None:
        vars(module)[_MARK] = checked
        super().exec_module(module)


class _Finder(MetaPathFinder):
    def __init__(self, modules: set[str]) -> None:
        self._modules = modules

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        spec = PathFinder.find_spec(fullname, path, target) if fullname in self._modules else None
        if spec is not None and isinstance(spec.loader, SourceFileLoader):
            spec.loader = _Loader(spec.loader.name, spec.loader.path)
        return spec
