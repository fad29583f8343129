"""Large result tables: finished parts joined to one Parquet file, most of them as the bytes that they are."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

import pyarrow as pa
import pyarrow.parquet as pq

from .footer import MAGIC, Struct, footer_bytes, footer_of, integer, integer_of, struct_bytes
from .tables import ROW_GROUP, Seal, atomic, encoded, release_memory, unsealed

_AS_THEY_ARE = ROW_GROUP // 4
"""Rows from which on a part becomes a row group of its own; smaller ones are put together, and encoded again."""
_PARTS_AHEAD = 3
_ROWS, _GROUPS = 3, 4  # of parquet.thrift's FileMetaData
_COLUMNS, _GROUP_SIZE, _GROUP_ROWS, _GROUP_START, _GROUP_STORED = 1, 2, 3, 5, 6  # of RowGroup
_CHUNK_START, _CHUNK = 2, 3  # of ColumnChunk; indices of pages, bloom filters and keys are not written, nor copied
_PATH, _SIZE, _STORED, _DATA, _DICTIONARY = 3, 6, 7, 9, 11  # of ColumnMetaData


@dataclass(frozen=True)
class EncodedRows:
    """Consecutive rows of a table, as the bytes of a Parquet file of its schema."""

    content: bytes
    rows: int

    def table(self, columns: Sequence[str] | None = None) -> pa.Table:
        """The rows, or some columns of them."""
        file = pq.ParquetFile(pa.BufferReader(self.content), page_checksum_verification=True)
        return file.read(columns)


@dataclass(frozen=True)
class Late:
    """A column that is known when all parts are: `of` finds it, in a table of the columns `needs` and itself."""

    name: str
    needs: Sequence[str]
    of: Callable[[pa.Table], pa.Table]


def write_joined(
    parts: Iterable[EncodedRows], late: Late, schema: pa.Schema, path: Path, seal: Seal = unsealed
) -> None:
    """Write one Parquet file of parts, of which `late` is another column; atomic, with errors as for `tables.atomic`.

    Of a large part, the bytes of all other columns are copied. Small ones are put together to row groups, one of
    which is in memory. The next part is read while one is written.
    """
    with atomic(path, seal) as hidden, hidden.open("wb") as sink:
        joiner = _Joiner(sink, schema)
        waiting: list[pa.Table] = []

        def write() -> None:
            if waiting:
                table = pa.concat_tables(waiting).unify_dictionaries()
                joiner.add(encoded(late.of(table)))
            waiting.clear()
            release_memory()

        for part in _ahead(iter(parts)):
            if part.rows >= _AS_THEY_ARE:
                write()
                joiner.add(part.content, late.name, encoded(late.of(part.table(late.needs)).select([late.name])))
                continue
            waiting.append(part.table())
            if sum(table.num_rows for table in waiting) >= ROW_GROUP:
                write()
        write()
        joiner.finish()


@dataclass
class _Joiner:
    """A Parquet file that grows by the row groups of others of its schema, whose bytes are copied."""

    sink: BinaryIO
    schema: pa.Schema
    _footer: Struct = field(init=False)
    _groups: list[bytes] = field(default_factory=list)
    _rows: int = 0

    def __post_init__(self) -> None:
        self._footer, _ = footer_of(encoded(self.schema.empty_table()))
        self.sink.write(MAGIC)

    def add(self, content: bytes, column: str = "", other: bytes = b"") -> None:
        """Append the row groups of a file; `column` is taken from an `other` file, of this column alone."""
        groups = _groups_of(content)
        others = _groups_of(other) if other else [{}] * len(groups)
        for group, late in zip(groups, others, strict=True):
            begun = self.sink.tell()
            kind, (items, held) = group[_COLUMNS]
            chunks = [
                self._copied(late[_COLUMNS][1][1][0], other)
                if chunk[_CHUNK][1][_PATH][1][1] == [column.encode()]
                else self._copied(chunk, content)
                for chunk in held
            ]
            made: Struct = {_COLUMNS: (kind, (items, chunks)), _GROUP_ROWS: group[_GROUP_ROWS]}
            made[_GROUP_SIZE] = integer(sum(integer_of(chunk[_CHUNK][1], _SIZE) for chunk in chunks))
            made[_GROUP_STORED] = integer(sum(integer_of(chunk[_CHUNK][1], _STORED) for chunk in chunks))
            made[_GROUP_START] = integer(begun)
            self._groups.append(struct_bytes(made))
            self._rows += integer_of(group, _GROUP_ROWS)

    def finish(self) -> None:
        """Write where everything is."""
        kind, (items, _) = self._footer[_GROUPS]
        whole = self._footer | {_ROWS: integer(self._rows), _GROUPS: (kind, (items, self._groups))}
        self.sink.write(footer_bytes(whole))

    def _copied(self, chunk: Struct, content: bytes) -> Struct:
        """A column of a row group, and where it is now."""
        kind, held = chunk[_CHUNK]
        places = {place: integer_of(held, place) for place in (_DATA, _DICTIONARY) if place in held}
        start = min(places.values())
        moved = self.sink.tell() - start
        self.sink.write(memoryview(content)[start : start + integer_of(held, _STORED)])
        moved_places = {place: integer(at + moved) for place, at in places.items()}
        return {_CHUNK_START: integer(0), _CHUNK: (kind, held | moved_places)}


def _groups_of(content: bytes) -> list[Struct]:
    footer, _ = footer_of(content)
    groups: list[Struct] = footer[_GROUPS][1][1]
    return groups


def _ahead(parts: Iterator[EncodedRows]) -> Iterator[EncodedRows]:
    """The same parts; a thread makes the next few while one is used."""
    with ThreadPoolExecutor(1) as thread:
        coming = deque(thread.submit(next, parts, None) for _ in range(_PARTS_AHEAD))
        while (part := coming.popleft().result()) is not None:
            coming.append(thread.submit(next, parts, None))
            yield part
