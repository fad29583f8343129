"""Large result tables: finished parts joined to one Parquet file as they come, most of them as the bytes they are."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from ..base.disk import Digest
from ..base.types import BoolArray, IndexArray
from .atomic import Seal, hidden_beside, refused_by_disk, unsealed
from .footer import LIST, MAGIC, STRUCT, Struct, footer_bytes, footer_of, integer, integer_of, struct_bytes
from .tables import ROW_GROUP, encoded, release_memory

_AS_THEY_ARE = ROW_GROUP // 4
"""Rows from which on a part becomes a row group of its own; smaller ones are put together, and encoded again."""
_ROWS, _GROUPS = 3, 4  # of parquet.thrift's FileMetaData
_COLUMNS, _GROUP_SIZE, _GROUP_ROWS, _GROUP_START, _GROUP_STORED = 1, 2, 3, 5, 6  # of RowGroup
_CHUNK_START, _CHUNK = 2, 3  # of ColumnChunk; indices of pages, bloom filters and keys are not written, nor copied
_PATH, _SIZE, _STORED, _DATA, _DICTIONARY = 3, 6, 7, 9, 11  # of ColumnMetaData


@dataclass(frozen=True)
class RowsPart:
    """Consecutive rows of a table, as the bytes of a Parquet file of its schema.

    `few`: those of its rows that a late column may mark; `at`: where among the rows they are, ndarray[n_few].
    """

    content: bytes
    rows: int
    few: pa.Table
    at: IndexArray

    @staticmethod
    def of(table: pa.Table) -> RowsPart:
        """A short table, all of whose rows may be marked."""
        return RowsPart(encoded(table), table.num_rows, table, np.arange(table.num_rows))


@dataclass(frozen=True)
class Late:
    """A column of flags that is known when all parts are: `of` says which of the few rows it marks, by columns `needs`.

    All other rows have False.
    """

    name: str
    needs: Sequence[str]
    of: Callable[[pa.Table], BoolArray]


@contextmanager
def joining(late: Late, schema: pa.Schema, path: Path, seal: Seal = unsealed) -> Iterator[Joining]:
    """A Parquet file that takes in parts while the block stands, and `late` at its end; atomic.

    Raises OutputError when the disk refuses. What the block raises is raised as it is, and no file is left.
    """
    written = _Written()

    def sealed(hidden: Path, _: Digest | None = None) -> None:
        seal(hidden, written.digest())

    with ExitStack() as stack:
        with refused_by_disk(path):
            hidden = stack.enter_context(hidden_beside(path, sealed))
            sink = hidden.open("wb")
            stack.callback(_given_up, sink)
            whole = Joining(path, sink, written, schema, late)
        yield whole
        with refused_by_disk(path):
            whole.finish()
            sink.close()
            stack.close()


def _given_up(sink: BinaryIO) -> None:
    """What is not written yet of a file that is removed is of no use."""
    with suppress(OSError):
        sink.close()


class _Written:
    """Bytes that were written one after the other: how many, and their digest, for which they need not be read."""

    def __init__(self) -> None:
        self.size, self._sha256 = 0, hashlib.sha256()

    def add(self, content: bytes | memoryview) -> None:
        self.size += len(content)
        self._sha256.update(content)

    def digest(self) -> Digest:
        return Digest(self._sha256.hexdigest(), self.size)


@dataclass
class _Group:
    """A row group whose late column is not written yet: bytes of its other columns' `ColumnChunk`s, and None for that.

    `few` and `at`: the rows that the late column may mark; `size`, `stored`: bytes, raw and as they are on the disk.
    """

    rows: int
    start: int
    few: pa.Table
    at: IndexArray
    chunks: list[bytes | None] = field(default_factory=list)
    size: int = 0
    stored: int = 0


@dataclass
class Joining:
    """A Parquet file that grows by the row groups of parts, whose bytes are copied.

    Small parts are put together to row groups, one of which is in memory. The late column's chunks stand behind all
    others, where the footer finds them.
    """

    path: Path
    _sink: BinaryIO
    _written: _Written
    _schema: pa.Schema
    _late: Late
    _groups: list[_Group] = field(default_factory=list)
    _small: list[RowsPart] = field(default_factory=list)
    _small_rows: int = 0

    def __post_init__(self) -> None:
        self._write(MAGIC)

    @property
    def needs(self) -> Sequence[str]:
        """What must be known of the few rows of a part."""
        return self._late.needs

    def add(self, part: RowsPart) -> None:
        """Append the rows of a part."""
        with refused_by_disk(self.path):
            if part.rows >= _AS_THEY_ARE:
                self._write_small()
                self._append(part)
                return
            self._small.append(part)
            self._small_rows += part.rows
            if self._small_rows >= ROW_GROUP:
                self._write_small()

    def finish(self) -> None:
        """Write the late column, and where everything is; raises OSError."""
        self._write_small()
        self._write_late()
        footer, _ = footer_of(encoded(self._schema.empty_table()))
        rows, groups = integer(sum(group.rows for group in self._groups)), list(map(_group_bytes, self._groups))
        self._write(footer_bytes(footer | {_ROWS: rows, _GROUPS: (footer[_GROUPS][0], (STRUCT, groups))}))

    def _write(self, content: bytes | memoryview) -> None:
        self._sink.write(content)
        self._written.add(content)

    def _write_late(self) -> None:
        if not self._groups:
            return
        schema, flags = pa.schema([self._schema.field(self._late.name)]), []
        for group in self._groups:
            own = np.zeros(group.rows, dtype=bool)
            own[group.at] = self._late.of(group.few)
            flags.append(pa.table([pa.array(own)], schema=schema))
        content = encoded(*flags)
        for group, late in zip(self._groups, _groups_of(content), strict=True):
            (chunk,) = late[_COLUMNS][1][1]
            group.chunks = [self._copied(group, chunk, content) if each is None else each for each in group.chunks]

    def _write_small(self) -> None:
        parts, self._small, self._small_rows = self._small, [], 0
        if not parts:
            return
        tables = [pq.read_table(pa.BufferReader(each.content), page_checksum_verification=True) for each in parts]
        starts = np.cumsum([0, *(each.rows for each in parts)])
        at = np.concatenate([each.at + start for each, start in zip(parts, starts, strict=False)])
        few = pa.concat_tables([each.few.select(self._late.needs) for each in parts]).unify_dictionaries()
        whole = pa.concat_tables(tables).unify_dictionaries()
        self._append(RowsPart(encoded(whole), whole.num_rows, few, at))
        release_memory()

    def _append(self, part: RowsPart) -> None:
        made = _Group(part.rows, self._written.size, part.few.select(self._late.needs), part.at)
        (whole,) = _groups_of(part.content)
        for chunk in whole[_COLUMNS][1][1]:
            late = chunk[_CHUNK][1][_PATH][1][1] == [self._late.name.encode()]
            made.chunks.append(None if late else self._copied(made, chunk, part.content))
        self._groups.append(made)

    def _copied(self, group: _Group, chunk: Struct, content: bytes) -> bytes:
        """A column of a row group, and where it is now."""
        kind, held = chunk[_CHUNK]
        places = {place: integer_of(held, place) for place in (_DATA, _DICTIONARY) if place in held}
        start, stored = min(places.values()), integer_of(held, _STORED)
        moved = self._written.size - start
        self._write(memoryview(content)[start : start + stored])
        group.size += integer_of(held, _SIZE)
        group.stored += stored
        moved_places = {place: integer(at + moved) for place, at in places.items()}
        return struct_bytes({_CHUNK_START: integer(0), _CHUNK: (kind, held | moved_places)})


def _group_bytes(group: _Group) -> bytes:
    facts = {_GROUP_SIZE: group.size, _GROUP_ROWS: group.rows, _GROUP_START: group.start, _GROUP_STORED: group.stored}
    columns: Struct = {_COLUMNS: (LIST, (STRUCT, group.chunks))}
    return struct_bytes(columns | {number: integer(value) for number, value in facts.items()})


def _groups_of(content: bytes) -> list[Struct]:
    footer, _ = footer_of(content)
    found: list[Struct] = footer[_GROUPS][1][1]
    return found
