"""Dataclasses as JSON and back, bit for bit, by the types of their fields. Reading makes data, and runs nothing.

A float is its hexadecimal form, so that every digit, infinities and NaN survive; an array is its bytes in base64.
"""

from __future__ import annotations

import base64
import json
import math
import types
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np

_SEQUENCES = {tuple: tuple, list: list, Sequence: tuple}


def to_json(value: object) -> bytes:
    """A value of dataclasses, arrays, sequences, mappings and plain values; raises TypeError for anything else."""
    return json.dumps(_plain(value), allow_nan=False).encode("utf-8")


def from_json(kind: Any, content: bytes) -> Any:
    """The value of the type `kind` that `to_json` wrote; raises ValueError when the text holds none."""
    try:
        return _made(kind, json.loads(content))
    except (ValueError, TypeError, KeyError, OverflowError, RecursionError) as error:
        raise ValueError(f"no {kind}: {error}") from None


def _plain(value: Any) -> Any:
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: _plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, np.ndarray):
        kind = value.dtype.newbyteorder("<")
        if kind.hasobject:
            raise TypeError("cannot be kept: an array of objects")
        content = np.ascontiguousarray(value, dtype=kind).tobytes()
        return {"dtype": kind.str, "shape": list(value.shape), "base64": base64.b64encode(content).decode("ascii")}
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float):
        return value.hex()
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, Mapping):
        return {_text(key): _plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    raise TypeError(f"cannot be kept: {type(value).__name__}")


def _text(key: object) -> str:
    if not isinstance(key, str):
        raise TypeError(f"cannot be kept as a key: {type(key).__name__}")
    return key


def _made(kind: Any, data: Any) -> Any:
    """`data` as a value of the type `kind`."""
    if is_dataclass(kind):
        return _record(kind, _of(dict, data))
    origin = get_origin(kind)
    return _of_plain(kind, data) if origin is None else _of_generic(kind, origin, data)


def _of_plain(kind: Any, data: Any) -> Any:
    if kind is float:
        return float(data) if type(data) is int else float.fromhex(_of(str, data))
    if kind in (bool, int, str):
        return _of(kind, data)
    if kind in (None, type(None)):
        return _checked(data, data is None)
    raise TypeError(f"cannot be read back: {kind}")


def _of_generic(kind: Any, origin: Any, data: Any) -> Any:
    kinds = get_args(kind)
    if hasattr(origin, "__value__"):  # NumPy's NDArray is a type alias with some versions of Python and NumPy
        return _made(origin.__value__[kinds], data)
    if origin in (Union, types.UnionType):
        return _one_of(kinds, data)
    if origin is np.ndarray:
        return _array(np.dtype(get_args(kinds[1])[0]), data)
    if origin in _SEQUENCES:
        return _sequence(origin, kinds, data)
    if origin is Literal:
        return _checked(data, any(data == value and type(data) is type(value) for value in kinds))
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return {key: _made(kinds[1], inner) for key, inner in _of(dict, data).items()}
    raise TypeError(f"cannot be read back: {kind}")


def _checked(data: Any, fits: bool) -> Any:
    if not fits:
        raise ValueError(f"does not fit: {str(data)[:40]!r}")
    return data


def _of(kind: type, data: Any) -> Any:
    return _checked(data, type(data) is kind)


def _one_of(kinds: Sequence[Any], data: Any) -> Any:
    """The value as the first of several types that it fits."""
    for kind in kinds:
        try:
            return _made(kind, data)
        except (ValueError, KeyError, OverflowError):
            continue
    raise ValueError("fits none of its types")


def _array(dtype: np.dtype[Any], data: Any) -> Any:
    held = _of(dict, data)
    kind = dtype.newbyteorder("<")
    _checked(held["dtype"], held["dtype"] == kind.str)
    content = base64.b64decode(_of(str, held["base64"]), validate=True)
    shape = [_checked(_of(int, n), n >= 0) for n in _of(list, held["shape"])]
    _checked(shape, math.prod(shape) * kind.itemsize == len(content))
    return np.frombuffer(content, dtype=kind).reshape(shape).astype(dtype)


def _sequence(origin: Any, kinds: Sequence[Any], data: Any) -> Any:
    items = _of(list, data)
    if origin is tuple and (len(kinds) != 2 or kinds[1] is not Ellipsis):
        _checked(items, len(items) == len(kinds))
        return tuple(_made(kind, item) for kind, item in zip(kinds, items, strict=True))
    return _SEQUENCES[origin](_made(kinds[0], item) for item in items)


def _record(kind: Any, held: dict[str, Any]) -> Any:
    hints, names = get_type_hints(kind), [field.name for field in fields(kind)]
    _checked(list(held), held.keys() == set(names))
    return kind(**{name: _made(hints[name], held[name]) for name in names})
