"""Variables of a MATLAB file, as SciPy reads them once their sizes are known to fit what is there.

SciPy's reader believes what a file says of itself: a damaged one may ask for more memory than there is, or ends in any
error. Of compressed variables it leaves the checksum unread.
"""

from __future__ import annotations

import io
import math
import struct
import warnings
import zlib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

HEADER_BYTES = 128
_MATRIX, _COMPRESSED = 14, 15
_CELL, _CHAR, _OPAQUE = 1, 4, 17
_NUMERIC = range(6, 16)
"""Classes of arrays: double, single and eight kinds of integers (MAT-File Format, table 1-3)."""
_COMPLEX = 0x0800
_MOST_DIMENSIONS = 32
_HEAD_BYTES = 4096
"""Enough for flags, dimensions and name of a variable (MATLAB: 63 letters)."""
_MOST_TEXT = 4096
"""Letters of an entry of a cell array."""


class DamagedError(Exception):
    """What a file says of itself cannot be."""


def read_variables(content: bytes, wanted: Sequence[str], most_bytes: int) -> tuple[Mapping[str, Any], list[str]]:
    """The `wanted` variables of a version 5 file that are arrays of real numbers, texts or cell arrays of texts.

    Also the names of all variables; one of them that is wanted and not among what is found is of another kind. Version
    4 files are read whole. At most `most_bytes` are unpacked of a variable. Raises DamagedError, also for any error of
    SciPy's; NotImplementedError for a version 7.3 (HDF5) file.
    """
    if content[:4] == b"\x89HDF" or content[124:128] in (b"\x00\x02IM", b"\x02\x00MI"):
        raise NotImplementedError
    if len(content) >= 4 and 0 in content[:4]:
        found = _loaded(content)
        return found, list(found)
    order = {b"IM": "<", b"MI": ">"}.get(content[126:HEADER_BYTES])
    if order is None:
        raise DamagedError("no header of MATLAB")
    kept: dict[str, bytes] = {}
    names: list[str] = []
    for matrix in _matrices(content, order, most_bytes):
        name = _Matrix(matrix(_HEAD_BYTES), order).name
        if name in kept:
            raise DamagedError(f"`{name}` occurs twice")
        if name in wanted:
            kept[name] = matrix(None)
        names.append(name)
    usable = [data for data in kept.values() if _Matrix(data, order).usable]
    again = b"".join(struct.pack(order + "II", _MATRIX, len(data)) + data for data in usable)
    return _loaded(content[:HEADER_BYTES] + again), names


def _loaded(content: bytes) -> Mapping[str, Any]:
    from scipy.io import loadmat  # noqa: PLC0415  (slow to import, seldom needed)

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # it only warns of a variable that it cannot read
            found = loadmat(io.BytesIO(content), squeeze_me=False, chars_as_strings=True)
    except Exception as error:  # of bytes that mean nothing its decoders raise whatever they meet first
        raise DamagedError(str(error) or type(error).__name__) from None
    return {name: value for name, value in found.items() if not name.startswith("__")}


def _matrices(content: bytes, order: str, most_bytes: int) -> Iterator[Any]:
    """The variables of a file, each a function that unpacks its first bytes, or all of them (None)."""
    at = HEADER_BYTES
    while at < len(content):
        kind, start, size, at = _tag(content, at, order)
        data = content[start : start + size]
        if kind == _MATRIX:
            yield lambda most, data=data: data if most is None else data[:most]
        elif kind == _COMPRESSED:
            yield lambda most, data=data: _unpacked(data, order, most_bytes, most)
        else:
            raise DamagedError(f"no variable at byte {start}")


def _unpacked(data: bytes, order: str, most_bytes: int, most: int | None) -> bytes:
    """The matrix inside a compressed element, without its tag: its first bytes, or all with the checksum compared."""
    unpacker = zlib.decompressobj()
    try:
        found = unpacker.decompress(data, (most_bytes if most is None else most) + 8)
    except zlib.error as error:
        raise DamagedError(str(error)) from None
    if most is None and not unpacker.eof:
        larger = bool(unpacker.unconsumed_tail)
        raise DamagedError(f"a variable of more than {most_bytes:,} bytes" if larger else "a variable ends early")
    kind, start, size, _ = _tag(found, 0, order, whole=most is None)
    if kind != _MATRIX:
        raise DamagedError("no variable in a compressed element")
    return found[start : start + size]


def _tag(content: bytes, at: int, order: str, *, whole: bool = True) -> tuple[int, int, int, int]:
    """Type, start and size of the element at a byte, and where the next one starts; `whole`: it must be there."""
    if at + 8 > len(content):
        raise DamagedError("the file ends early")
    kind, size = struct.unpack_from(order + "II", content, at)
    start, after = at + 8, at + 8 + size
    if kind >> 16:  # a small element: size, type and data in eight bytes
        kind, size = kind & 0xFFFF, kind >> 16
        start, after = at + 4, at + 8
        if size > 4:
            raise DamagedError(f"a small element of {size} bytes")
    if whole and start + size > len(content):
        raise DamagedError("the file ends early")
    return kind, start, size, after


class _Matrix:
    """An array as its head describes it: class, complex or not, dimensions, name; the rest are its elements."""

    def __init__(self, data: bytes, order: str) -> None:
        self._data, self._order = data, order
        _, start, size, at = _tag(data, 0, order)
        if size != 8:
            raise DamagedError("an array without flags")
        (flags,) = struct.unpack_from(order + "I", data, start)
        self.kind, self.is_complex = flags & 0xFF, bool(flags & _COMPLEX)
        self.dimensions: tuple[int, ...] = ()
        if self.kind != _OPAQUE:  # an object of MATLAB's, which has none
            at = self._read_dimensions(at)
        _, start, size, at = _tag(data, _aligned(at), order)
        self.name = data[start : start + size].decode("latin-1").strip("\0")
        self._at = _aligned(at)

    def _read_dimensions(self, at: int) -> int:
        _, start, size, at = _tag(self._data, _aligned(at), self._order)
        if size % 4 or not 2 <= size // 4 <= _MOST_DIMENSIONS:
            raise DamagedError("an array without dimensions")
        self.dimensions = struct.unpack_from(f"{self._order}{size // 4}i", self._data, start)
        return at

    @property
    def usable(self) -> bool:
        """Whether it is of a kind that is read; raises DamagedError where it cannot be as large as it says."""
        count = math.prod(self.dimensions)
        if min(self.dimensions, default=0) < 0 or count > len(self._data):
            raise DamagedError(
                f"`{self.name}` of {' x '.join(map(str, self.dimensions))} values does not fit its bytes"
            )
        if self.kind == _CELL:
            return self._holds_texts(count)
        return (self.kind in _NUMERIC or self.kind == _CHAR) and not self.is_complex

    def _holds_texts(self, count: int) -> bool:
        at = self._at
        for _ in range(count):
            kind, start, size, at = _tag(self._data, at, self._order)
            if kind != _MATRIX or size > _MOST_TEXT:
                return False
            inner = _Matrix(self._data[start : start + size], self._order)
            if inner.kind != _CHAR or not inner.usable:
                return False
            at = _aligned(at)
        return True


def _aligned(at: int) -> int:
    """Elements inside an array start at multiples of eight bytes."""
    return -(-at // 8) * 8
