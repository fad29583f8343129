"""Arrow's arrays from NumPy's, and back, without pandas.

PyArrow's own conversions load pandas, for which workers have no other use.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from ..base.types import BoolArray, FloatArray, IndexArray


def flags(values: BoolArray) -> pa.Array:
    """Truth values, ndarray[n]."""
    return pa.Array.from_buffers(pa.bool_(), values.size, [None, _bits(values)])


def places(values: IndexArray) -> pa.Array:
    """Whole numbers, ndarray[n], as int64."""
    return pa.Array.from_buffers(pa.int64(), values.size, [None, pa.py_buffer(np.ascontiguousarray(values, np.int64))])


def numbers(values: FloatArray) -> pa.Array:
    """Numbers, ndarray[n], as float64; NaN is null."""
    there = ~np.isnan(values)
    valid = None if there.all() else _bits(there)
    return pa.Array.from_buffers(
        pa.float64(), values.size, [valid, pa.py_buffer(np.ascontiguousarray(values, np.float64))]
    )


def words(texts: list[str], which: IndexArray) -> pa.Array:
    """Words by their places in a list, ndarray[n], as a dictionary of strings with indices of int32."""
    encoded = [text.encode() for text in texts]
    ends = np.concatenate([[0], np.cumsum([len(each) for each in encoded])]).astype(np.int32)
    named = pa.StringArray.from_buffers(len(texts), pa.py_buffer(ends), pa.py_buffer(b"".join(encoded)))
    at = pa.Array.from_buffers(pa.int32(), which.size, [None, pa.py_buffer(np.ascontiguousarray(which, np.int32))])
    return pa.DictionaryArray.from_arrays(at, named)


def _bits(values: BoolArray) -> pa.Buffer:
    return pa.py_buffer(np.packbits(values, bitorder="little"))


def values_of(column: pa.Array | pa.ChunkedArray) -> NDArray[Any]:
    """A column of numbers or truth values, ndarray[n]; null is NaN.

    Raises ValueError for whole numbers and truth values of which some are null.
    """
    chunks = column.chunks if isinstance(column, pa.ChunkedArray) else [column]
    return np.concatenate([np.zeros(0, _kind(column.type)), *(_values(chunk) for chunk in chunks)])


def texts_of(column: pa.ChunkedArray) -> list[str]:
    """The words of a dictionary-encoded column, none of which is null."""
    found: list[str] = []
    for chunk in column.chunks:
        words = chunk.dictionary.to_pylist()
        found += [words[at] for at in _raw(chunk.indices).tolist()]
    return found


def holds_one_of(column: pa.DictionaryArray, words: Collection[str]) -> BoolArray:
    """Where a column holds one of some words, ndarray[n]."""
    at = [index for index, word in enumerate(column.dictionary.to_pylist()) if word in words]
    if len(at) == len(column.dictionary):
        return _there(column.indices)
    if not at:
        return np.zeros(len(column), dtype=bool)
    return np.isin(np.where(_there(column.indices), _raw(column.indices), -1), at)


def _values(chunk: pa.Array) -> NDArray[Any]:
    flagged = chunk.type == pa.bool_()
    found = _unpacked(chunk.buffers()[1], chunk) if flagged else _raw(chunk)
    if not chunk.null_count:
        return found
    if chunk.type != pa.float64():
        raise ValueError(f"{chunk.null_count} of {len(chunk)} values of {chunk.type} are null")
    return np.where(_there(chunk), found, np.nan)


def _raw(chunk: pa.Array) -> NDArray[Any]:
    """The numbers of a column, ndarray[n]; anything where it is null."""
    kind = _kind(chunk.type)
    return np.frombuffer(chunk.buffers()[1] or b"", kind, len(chunk), chunk.offset * kind.itemsize)


def _kind(kind: pa.DataType) -> np.dtype[Any]:
    """NumPy's kind of numbers or truth values; to say that of truth values, some PyArrow load pandas."""
    if pa.types.is_boolean(kind):
        return np.dtype(bool)
    letter = "f" if pa.types.is_floating(kind) else "u" if pa.types.is_unsigned_integer(kind) else "i"
    return np.dtype(f"{letter}{kind.bit_width // 8}")


def _there(chunk: pa.Array) -> BoolArray:
    """Where a column is not null, ndarray[n]."""
    valid = chunk.buffers()[0]
    return np.ones(len(chunk), dtype=bool) if valid is None else _unpacked(valid, chunk)


def _unpacked(bits: pa.Buffer, chunk: pa.Array) -> BoolArray:
    found = np.unpackbits(np.frombuffer(bits, dtype=np.uint8), bitorder="little", count=chunk.offset + len(chunk))
    return found[chunk.offset :].astype(bool)
