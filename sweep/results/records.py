"""Dataclasses as JSON and back, bit for bit, by the types of their fields. Reading makes data, and runs nothing."""

from __future__ import annotations

import base64
import json
import types
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from itertools import repeat
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np


def to_json(value: object) -> bytes:
    """A value of dataclasses, arrays, sequences, mappings and plain values; raises TypeError for anything else."""
    return json.dumps(value, default=_plain).encode("utf-8")


def from_json(kind: Any, content: bytes) -> Any:
    """The value of the type `kind` that `to_json` wrote; raises ValueError when the text holds none."""
    try:
        return _made(kind, json.loads(content))
    except (ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError) as error:
        raise ValueError(f"no {kind}: {error}") from None


def _plain(value: Any) -> Any:
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: getattr(value, field.name) for field in fields(value)}
    if isinstance(value, np.ndarray) and not value.dtype.hasobject:
        little = np.ascontiguousarray(value, dtype=value.dtype.newbyteorder("<"))
        content = base64.b64encode(little.tobytes()).decode("ascii")
        return {"dtype": little.dtype.str, "shape": value.shape, "base64": content}
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Mapping):
        return dict(value)
    raise TypeError(f"cannot be kept: {type(value).__name__}")


def _made(kind: Any, data: Any) -> Any:
    """`data` as a value of the type `kind`."""
    origin, kinds = get_origin(kind), get_args(kind)
    if hasattr(origin, "__value__"):  # NumPy's NDArray is a type alias with some versions of Python and NumPy
        return _made(origin.__value__[kinds], data)
    if is_dataclass(kind):
        return _record(kind, data)
    if origin in (Union, types.UnionType):
        (inner,) = (one for one in kinds if one is not types.NoneType)
        return None if data is None else _made(inner, data)
    if origin is np.ndarray:
        content = base64.b64decode(data["base64"], validate=True)
        return np.frombuffer(content, data["dtype"]).reshape(data["shape"]).astype(get_args(kinds[1])[0])
    if origin in (list, tuple, Sequence):
        return _sequence(origin, kinds, data)
    mapping = isinstance(origin, type) and issubclass(origin, Mapping)
    return {key: _made(kinds[1], inner) for key, inner in data.items()} if mapping else _checked(kind, data)


def _checked(kind: Any, data: Any) -> Any:
    """A plain value of its type."""
    if kind is float and type(data) is int:
        return float(data)
    if data not in get_args(kind) if get_origin(kind) is Literal else type(data) is not kind:
        raise ValueError(f"does not fit {kind}: {str(data)[:40]!r}")
    return data


def _record(kind: Any, data: Any) -> Any:
    hints, names = get_type_hints(kind), [field.name for field in fields(kind)]
    if data.keys() != set(names):
        raise ValueError(f"other fields: {list(data)}")
    return kind(**{name: _made(hints[name], data[name]) for name in names})


def _sequence(origin: Any, kinds: Sequence[Any], data: Any) -> Any:
    if not isinstance(data, list):
        raise TypeError(f"no list: {str(data)[:40]!r}")
    alike = origin is not tuple or kinds[-1] is Ellipsis
    items = [_made(*pair) for pair in zip(repeat(kinds[0], len(data)) if alike else kinds, data, strict=True)]
    return items if origin is list else tuple(items)
