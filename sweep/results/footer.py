"""The end of a Parquet file, which says where its columns are, as plain values: Thrift's compact protocol.

Sources: github.com/apache/parquet-format, README.md and parquet.thrift (fields by number); github.com/apache/thrift,
doc/specs/thrift-compact-protocol.md (how they are written).
"""

from __future__ import annotations

from typing import Any

MAGIC = b"PAR1"
"""A Parquet file begins and ends so."""
Struct = dict[int, tuple[int, Any]]
"""A structure: the type and the value of each field, by its number.

A list is the type of its items, and these; an integer is as it is written, see `integer`."""
_TRUE, _FALSE, _BYTE, _I16, _I32, _I64, _DOUBLE, _BINARY, LIST, _SET, STRUCT = 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 12
_INTEGERS = (_I16, _I32, _I64)
_LENGTH = 4
"""Bytes in which the length of the footer stands before the last MAGIC."""


def footer_of(content: bytes) -> tuple[Struct, int]:
    """The `FileMetaData` of a Parquet file's bytes, and where it begins; raises ValueError where there is none."""
    end = len(content) - len(MAGIC) - _LENGTH
    if end < len(MAGIC) or content[:4] != MAGIC or content[-4:] != MAGIC:
        raise ValueError("no Parquet file")
    start = end - int.from_bytes(content[end : end + _LENGTH], "little")
    if start < len(MAGIC):
        raise ValueError("no footer")
    try:
        return _struct(content[start:end], 0)[0], start
    except (IndexError, RecursionError):
        raise ValueError("a footer that is cut") from None


def integer(value: int) -> tuple[int, int]:
    """A field of 64 bits as it is written: its type, and twice the value, which is not negative."""
    return _I64, value << 1


def integer_of(fields: Struct, number: int) -> int:
    """The value of an integer, which is not negative."""
    value: int = fields[number][1]
    return value >> 1


def footer_bytes(footer: Struct) -> bytes:
    """What stands at the end of a Parquet file with this `FileMetaData`."""
    content = struct_bytes(footer)
    return content + len(content).to_bytes(_LENGTH, "little") + MAGIC


def struct_bytes(fields: Struct) -> bytes:
    """A structure as it is written; another one may have these bytes in its place."""
    sink = bytearray()
    _write_struct(sink, fields)
    return bytes(sink)


def _struct(content: bytes, at: int) -> tuple[Struct, int]:
    """The structure that begins at a byte, and where it ends. Integers stay as they are written: zigzag."""
    found: Struct = {}
    number = 0
    while head := content[at]:
        kind, at = head & 15, at + 1
        if head > 15:
            number += head >> 4
        else:
            number, at = _varint(content, at)
            number = (number >> 1) ^ -(number & 1)
        if kind in _INTEGERS and content[at] < 128:  # most values
            found[number], at = (kind, content[at]), at + 1
        elif kind in (_TRUE, _FALSE):
            found[number] = kind, None  # the type says it
        else:
            value, at = _value(content, at, kind)
            found[number] = kind, value
    return found, at + 1


def _value(content: bytes, at: int, kind: int) -> tuple[Any, int]:
    if kind in _INTEGERS:
        return _varint(content, at)
    if kind == STRUCT:
        return _struct(content, at)
    if kind in (LIST, _SET):
        head, at = content[at], at + 1
        size, items = head >> 4, head & 15
        if size == 15:
            size, at = _varint(content, at)
        values = []
        for _ in range(size):
            value, at = _value(content, at, _BYTE if items in (_TRUE, _FALSE) else items)
            values.append(value)
        return (items, values), at
    if kind not in (_BYTE, _DOUBLE, _BINARY):
        raise ValueError(f"a value of type {kind}, which Parquet does not use")
    size, at = _varint(content, at) if kind == _BINARY else (1 if kind == _BYTE else 8, at)
    if at + size > len(content):
        raise IndexError
    return content[at : at + size], at + size


def _varint(content: bytes, at: int) -> tuple[int, int]:
    found = shift = 0
    while (byte := content[at]) > 127:
        found |= (byte & 127) << shift
        shift, at = shift + 7, at + 1
    return found | byte << shift, at + 1


def _write_struct(sink: bytearray, fields: Struct) -> None:
    before = 0
    for number, (kind, value) in sorted(fields.items()):
        if 0 < number - before < 16:
            sink.append((number - before) << 4 | kind)
        else:
            sink.append(kind)
            _write_varint(sink, number << 1 if number >= 0 else ~(number << 1))
        _write(sink, kind, value)
        before = number
    sink.append(0)


def _write(sink: bytearray, kind: int, value: Any) -> None:
    if kind in _INTEGERS:
        _write_varint(sink, value)
    elif kind == STRUCT and isinstance(value, dict):
        _write_struct(sink, value)
    elif kind in (LIST, _SET):
        items, values = value
        sink.append(min(len(values), 15) << 4 | items)
        if len(values) >= 15:
            _write_varint(sink, len(values))
        for item in values:
            _write(sink, _BYTE if items in (_TRUE, _FALSE) else items, item)
    elif kind not in (_TRUE, _FALSE):
        if kind == _BINARY:
            _write_varint(sink, len(value))
        sink += value  # of a structure: its bytes


def _write_varint(sink: bytearray, value: int) -> None:
    while value > 127:
        sink.append(value & 127 | 128)
        value >>= 7
    sink.append(value)
