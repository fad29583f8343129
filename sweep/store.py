"""Parquet and JSON on disk: explicit schema, atomic writes, shards that a kill cannot harm."""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import pyarrow as pa
import pyarrow.parquet as pq

from .errors import Fault, OutputError

SCHEMA_VERSION = "2"
RESULTS = "results.parquet"
SEARCH_LOG = "search.parquet"
FRONT = "front.parquet"
CURVES = "curves.parquet"
POINTS = "points.parquet"
RECOGNITION = "recognition.parquet"
PROVENANCE = "provenance.json"
RESOLVED = "study.resolved.yaml"
_SHARDS = "shards"


def result_schema(parameters: Sequence[str], quantities: Sequence[str]) -> pa.Schema:
    """Columns of the result table: keys, a column per parameter (unit in its name), quantities, verdicts."""
    text, number = pa.dictionary(pa.int32(), pa.string()), pa.float64()
    fields = [pa.field("design_id", pa.int64(), nullable=False)]
    fields += [pa.field(name, text) for name in ("kind", "name", "cfa", "family", "scenario")]
    fields += [pa.field(name, number) for name in (*parameters, *quantities, "violation", "limit", "gap")]
    fields += [pa.field("feasible", pa.bool_()), pa.field("pareto", pa.bool_())]
    fields += [pa.field("plan", text), pa.field("promised_dn", number), pa.field("status", text)]
    return pa.schema(fields, metadata={"cfa_sweep_schema": SCHEMA_VERSION})


def search_schema(parameters: Sequence[str]) -> pa.Schema:
    """Columns of the search's log: one row per evaluation of the smooth response.

    `sensitivity_min` is the level of the front that the evaluation belongs to; null in the search itself.
    """
    text, number = pa.dictionary(pa.int32(), pa.string()), pa.float64()
    fields = [pa.field("scenario", text), pa.field("sensitivity_min", number)]
    fields += [pa.field("start", pa.int32()), pa.field("evaluation", pa.int32())]
    names = (*parameters, "objective", "sensitivity", "cfa_sensitivity", "violation")
    fields += [pa.field(name, number) for name in names]
    return pa.schema([*fields, pa.field("status", text)], metadata={"cfa_sweep_schema": SCHEMA_VERSION})


def front_schema(parameters: Sequence[str]) -> pa.Schema:
    """Columns of the trade-off that the search traces: one row per level of sensitivity."""
    number = pa.float64()
    names = ("sensitivity_min", "objective", "sensitivity", "limit", "gap", *parameters)
    fields = [pa.field(name, number) for name in names] + [pa.field("evaluations", pa.int64())]
    return pa.schema(fields, metadata={"cfa_sweep_schema": SCHEMA_VERSION})


@contextmanager
def atomic(path: Path) -> Iterator[Path]:
    """Give a hidden name beside `path`; on success it is synced and takes the name of `path`, else it is removed.

    Raises OutputError when the disk refuses (full, read-only, no permission). A reader sees the old file or the new
    one, never a part.
    """
    hidden = path.with_name(f".tmp-{os.getpid()}-{path.name}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield hidden
        with hidden.open("rb") as handle:
            os.fsync(handle.fileno())
        hidden.replace(path)
    except OSError as error:
        raise OutputError(Fault(f"cannot be written: {error.strerror or error}", str(path))) from None
    finally:
        hidden.unlink(missing_ok=True)


def write_table(table: pa.Table, path: Path) -> None:
    """Write one Parquet file atomically; errors as for `atomic`."""
    with atomic(path) as hidden:
        pq.write_table(table, hidden, row_group_size=131_072)


def write_bytes(content: bytes, path: Path) -> None:
    """Write one file atomically; errors as for `atomic`."""
    with atomic(path) as hidden:
        hidden.write_bytes(content)


def write_text(text: str, path: Path) -> None:
    """Write one UTF-8 text file atomically; errors as for `atomic`."""
    write_bytes(text.encode("utf-8"), path)


def write_json(data: Mapping[str, Any], path: Path) -> None:
    """Write one JSON file atomically; errors as for `atomic`."""
    write_text(json.dumps(data, indent=2, sort_keys=True, allow_nan=False) + "\n", path)


def read_table(path: Path) -> pa.Table:
    """Read a Parquet file; raises OutputError when it is missing or damaged."""
    try:
        return pq.read_table(path)
    except (OSError, pa.ArrowException) as error:
        raise OutputError(Fault(f"cannot be read: {error}", str(path))) from None


class Shards:
    """Finished chunks of a run, one Parquet file each, named by index and key; kept until the run is whole."""

    def __init__(self, output: Path) -> None:
        self._folder = output / _SHARDS

    def path(self, index: int, key: str) -> Path:
        """Where the shard of a chunk stands; `key` is a hash of everything that its rows depend on."""
        return self._folder / f"{index:08d}-{key[:32]}.parquet"

    def load(self, index: int, key: str, schema: pa.Schema) -> pa.Table | None:
        """A finished shard, or None when it is missing or damaged (then it is computed again)."""
        path = self.path(index, key)
        if not path.exists():
            return None
        try:
            table = pq.read_table(path)
        except (OSError, pa.ArrowException):
            return None
        return table if table.schema.equals(schema) else None

    def save(self, index: int, key: str, table: pa.Table) -> None:
        """Keep a finished chunk; errors as for `atomic`."""
        write_table(table, self.path(index, key))

    def remove(self) -> None:
        """Drop all shards, after their rows stand in the result table."""
        if self._folder.is_dir():
            for path in self._folder.iterdir():
                path.unlink()
            self._folder.rmdir()


@contextmanager
def locked(output: Path) -> Iterator[None]:
    """Hold the output folder for one run; raises OutputError, naming the other run, when it is in use.

    The kernel drops the lock with its process, so a lock cannot go stale. Hidden files that a killed run left behind
    are removed.
    """
    lock = output / ".lock"
    try:
        output.mkdir(parents=True, exist_ok=True)
        handle: IO[str] = lock.open("a+", encoding="utf-8")
    except OSError as error:
        raise OutputError(Fault(f"cannot be written: {error.strerror or error}", str(output))) from None
    with handle:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            handle.seek(0)
            raise OutputError(
                Fault(f"in use by another run (process {handle.read().strip() or '?'})", str(output))
            ) from None
        handle.seek(0)
        handle.truncate()
        handle.write(str(os.getpid()))
        handle.flush()
        for left_over in output.rglob(".tmp-*"):
            left_over.unlink(missing_ok=True)
        yield
