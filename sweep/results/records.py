"""Dataclasses as JSON and back, bit for bit, by the types of their fields. Reading makes data, and runs nothing."""

from __future__ import annotations

import base64
import json
import types
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np
from jaxtyping import AbstractArray


def to_json(value: object) -> bytes:
    """Convert dataclasses, arrays, sequences, mappings and plain values to JSON.

    Raises TypeError if the value, or a part of it, has no JSON form.
    """
    return json.dumps(value, default=_plain).encode("utf-8")


def from_json(kind: Any, content: bytes) -> Any:
    """Convert JSON back to the value that `to_json` was given.

    Raises ValueError if the text is no such value.
    """
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
    """Convert `data` to a value of the type `kind`."""
    origin, kinds = get_origin(kind), get_args(kind)
    if hasattr(origin, "__value__"):  # NumPy's NDArray is a type alias with some versions of Python and NumPy
        return _made(origin.__value__[kinds], data)
    if is_dataclass(kind):
        hints = get_type_hints(kind)
        if data.keys() != {field.name for field in fields(kind)}:
            raise ValueError(f"other fields: {list(data)}")
        return kind(**{name: _made(hints[name], inner) for name, inner in data.items()})  # type: ignore[operator]
    if origin in (Union, types.UnionType):
        inner = [converted for converted in kinds if converted is not types.NoneType]
        return None if data is None else _made(next((one for one in inner if one is type(data)), inner[0]), data)
    if isinstance(kind, type) and issubclass(kind, AbstractArray):
        content = base64.b64decode(data["base64"], validate=True)
        array = np.frombuffer(content, data["dtype"]).reshape(data["shape"])
        array = array.astype(array.dtype.newbyteorder("="))
        if not isinstance(array, kind):
            raise ValueError(f"does not fit {kind}: {array.dtype} of shape {array.shape}")
        return array
    if origin in (list, tuple, Sequence):
        if not isinstance(data, list):
            raise TypeError(f"no list: {str(data)[:40]!r}")
        alike = origin is not tuple or kinds[-1] is Ellipsis
        pairs = zip(kinds[:1] * len(data) if alike else kinds, data, strict=True)
        return (list if origin is list else tuple)(_made(converted, inner) for converted, inner in pairs)
    return _value(kind, data)


def _value(kind: Any, data: Any) -> Any:
    """Convert a mapping or a plain value to its type."""
    origin, kinds = get_origin(kind), get_args(kind)
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return {key: _made(kinds[1], inner) for key, inner in data.items()}
    if kind is float and type(data) is int:
        return float(data)
    if data not in kinds if origin is Literal else type(data) is not kind:
        raise ValueError(f"does not fit {kind}: {str(data)[:40]!r}")
    return data
