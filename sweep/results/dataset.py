"""Rows of a run: a Parquet dataset of parts, each written once, by the worker that computed it where that is possible.

A part holds the key of what its rows depend on, and a checksum of each page: one that is missing, damaged or of other
work is computed again.
"""

from __future__ import annotations

import hashlib
import math
import os
import re
import stat
from collections.abc import Container
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from ..base.disk import is_real_folder, read_plain
from ..base.errors import OutputError, ValidationIssue
from .tables import RESULTS, encoded

_PART = re.compile(r"part-(\d{8})\.parquet")
_KEY = b"cfa_sweep_part"
_MOST_BYTES = 2**31


def part_name(number: int) -> str:
    """Return the name of a part in the folder of a run."""
    return f"{RESULTS}/part-{number:08}.parquet"


def encoded_part(table: pa.Table, key: str) -> bytes:
    """Return the file of a part."""
    return encoded(table.replace_schema_metadata({**(table.schema.metadata or {}), _KEY: key.encode()}))


def read_part(path: Path, key: str, schema: pa.Schema, rows: int) -> tuple[pa.Table, str] | None:
    """Return the rows of a part and the SHA-256 of its file; None if it is not there, damaged, or of other work.

    Size and schema are checked before rows are read, so that no more memory is taken than they need.
    """
    try:
        content = read_plain(path, _MOST_BYTES)
        file = pq.ParquetFile(pa.BufferReader(content), page_checksum_verification=True)
        is_of_key = (file.schema_arrow.metadata or {}).get(_KEY) == key.encode()
        if not is_of_key or file.metadata.num_rows != rows or not file.schema_arrow.equals(schema):
            return None
        return file.read().replace_schema_metadata(schema.metadata), hashlib.sha256(content).hexdigest()
    except (OSError, pa.ArrowException):
        return None


def part_paths(folder: Path) -> list[Path]:
    """Return the parts in the folder of a run, in the order of their rows; a link, pipe or folder is none."""
    inner = folder / RESULTS
    paths = sorted(inner.iterdir()) if is_real_folder(inner) else []
    return [path for path in paths if _PART.fullmatch(path.name) and stat.S_ISREG(path.lstat().st_mode)]


def refuse_others(folder: Path) -> None:
    """Raise OutputError if something else has the name of the dataset."""
    if os.path.lexists(folder / RESULTS) and not is_real_folder(folder / RESULTS):
        raise OutputError(ValidationIssue("file not created by sweep; move it", str(folder / RESULTS)))


def rows_in(folder: Path, designs: float = math.inf) -> tuple[int, int]:
    """Return the number of rows of a run's `designs`, and of parts, without those that cannot be read."""
    rows, parts = 0, 0
    for path in part_paths(folder):
        try:
            with pq.ParquetFile(path) as file:
                first = file.metadata.row_group(0).column(0).statistics.min
                rows += file.metadata.num_rows if first < designs else 0  # else the answers of a search
                parts += 1
        except (OSError, pa.ArrowException):
            continue
    return rows, parts


def strange_entries(folder: Path, known: Container[str]) -> list[str]:
    """Return what a reader of the dataset would take for rows, beside the `known` parts: copies, files of others."""
    inner, found = folder / RESULTS, list[str]()
    for path in sorted(inner.rglob("*")) if is_real_folder(inner) else ():
        skipped = any(part.startswith((".", "_")) for part in path.relative_to(inner).parts)
        name = path.relative_to(folder).as_posix()
        if name not in known and not is_real_folder(path) and (path.suffix == ".parquet" or not skipped):
            found.append(name)
    return found
