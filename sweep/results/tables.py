"""Parquet and JSON on disk: explicit schema, atomic writes, shards that a kill cannot harm."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from ..base.errors import Fault, OutputError
from ..base.types import BoolArray
from .arrays import which

if TYPE_CHECKING:
    import pandas as pd

SCHEMA_VERSION = "2"
RESULTS = "results.parquet"
SEARCH_LOG = "search.parquet"
FRONT = "front.parquet"
CURVES = "curves.parquet"
POINTS = "points.parquet"
RECOGNITION = "recognition.parquet"
CROSSINGS = "crossings.parquet"
LIMITED_BY = "limited_by.parquet"
ROBUSTNESS = "robustness.parquet"
PRICE = "price.parquet"
REGIONS_MAP = "regions.parquet"
SENSOR_MAP = "sensor_map.parquet"
TRADED, RENDERED = "color_noise.parquet", "rendered.parquet"
CHART, NIGHT = "chart", "night"
"""Pictures of which `rendered.parquet` has the areas."""
VALIDATED, LEFT_OUT = "validated.parquet", "leave_one_out.parquet"
VISION, VISION_CONDITIONS = "vision.parquet", "vision_conditions.parquet"
VISION_MISREAD = "vision_misread.parquet"
VISION_TABLES = (VISION, VISION_CONDITIONS, VISION_MISREAD)
"""Of the benchmark of vision: a row per image, per distance and level, per picture that was read wrongly."""
AUDIT = "audit.parquet"
PROVENANCE = "provenance.json"
RESOLVED = "study.resolved.yaml"
_PARAMETERS = "cfa_sweep_parameters"
_ROWS_AT_ONCE = 65_536
"""That PyArrow encodes; columns of one word take less time so than with its own 1,024."""
_TEXT = pa.dictionary(pa.int32(), pa.string())
_KEYS = (
    pa.field("design_id", pa.int64(), nullable=False),
    *(pa.field(name, _TEXT) for name in ("kind", "name", "cfa", "family", "scenario")),
)
_VERDICTS = (
    *(pa.field(name, pa.float64()) for name in ("violation", "limit", "gap")),
    *(pa.field(name, pa.bool_()) for name in ("feasible", "pareto")),
    pa.field("plan", _TEXT),
    pa.field("promised_dn", pa.float64()),
    pa.field("status", _TEXT),
)
ROW_COLUMNS = tuple(each.name for each in (*_KEYS, *_VERDICTS))
"""Columns of every result table; parameters and quantities stand between the keys and the verdicts."""
PLAIN, NAMED, SWEPT, FOUND = "reference", "design", "sweep", "search"
"""Kinds of rows: a plain CFA, a named design, one that was swept, the search's answer."""
FEW = (PLAIN, NAMED, FOUND)
"""Kinds of which there are few rows."""
ROW_GROUP = 131_072
"""Rows that are read and written at once."""
Seal = Callable[[Path], None]
"""Sees a file that is written to its end, before it takes its name."""


def result_schema(parameters: Sequence[str], quantities: Sequence[str]) -> pa.Schema:
    """Columns of the result table: keys, a column per parameter (unit in its name), quantities, verdicts."""
    number = pa.float64()
    fields = list(_KEYS) + [pa.field(name, number) for name in (*parameters, *quantities)] + list(_VERDICTS)
    return pa.schema(fields, metadata={"cfa_sweep_schema": SCHEMA_VERSION, _PARAMETERS: json.dumps(list(parameters))})


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
    """Columns of the trade-off that the search traces: one row per level of sensitivity.

    `cfa_sensitivity_min`: the same level for the whole CFA; null where several channels are modified.
    """
    number = pa.float64()
    names = ("sensitivity_min", "cfa_sensitivity_min", "objective", "sensitivity", "cfa_sensitivity", "limit", "gap")
    fields = [pa.field(name, number) for name in (*names, *parameters)] + [pa.field("evaluations", pa.int64())]
    return pa.schema(fields, metadata={"cfa_sweep_schema": SCHEMA_VERSION})


def unsealed(_: Path) -> None:
    """Nothing is noted of a file before it takes its name."""


@contextmanager
def refused_by_disk(path: Path) -> Iterator[None]:
    """Raises OutputError where the disk refuses (full, read-only, no permission) what is written for `path`."""
    try:
        yield
    except OSError as error:
        raise OutputError(Fault(f"cannot be written: {error.strerror or error}", str(path))) from None


def _sync(path: Path) -> None:
    with path.open("rb") as handle:
        os.fsync(handle.fileno())


@contextmanager
def hidden_beside(path: Path, seal: Seal = unsealed) -> Iterator[Path]:
    """Give a hidden name beside `path`; on success it is synced and takes the name of `path`, else it is removed.

    `seal` sees the whole hidden file before it takes its name. A symbolic link at `path` is replaced, not followed.
    A reader sees the old file or the new one, never a part. Raises OSError.
    """
    hidden = path.with_name(f".tmp-{os.getpid()}-{path.name}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        hidden.unlink(missing_ok=True)
        hidden.touch(exist_ok=False)  # a new file, not what a link of this name leads to
        yield hidden
        if seal is unsealed:
            _sync(hidden)
        else:
            with ThreadPoolExecutor(1) as aside:  # to read a large file takes about as long as to sync it
                synced = aside.submit(_sync, hidden)
                seal(hidden)
                synced.result()
        hidden.replace(path)
    finally:
        with suppress(OSError):  # where it could not be made, for example below a file
            hidden.unlink()


@contextmanager
def atomic(path: Path, seal: Seal = unsealed) -> Iterator[Path]:
    """`hidden_beside`, with one error: OutputError when the disk refuses."""
    with refused_by_disk(path), hidden_beside(path, seal) as hidden:
        yield hidden


def write_table(table: pa.Table, path: Path, seal: Seal = unsealed) -> None:
    """Write one Parquet file atomically, with a checksum of each page; `seal` and errors as for `atomic`."""
    with atomic(path, seal) as hidden:
        _write_table(table, hidden, row_group_size=ROW_GROUP)


def write_bytes(content: bytes, path: Path, seal: Seal = unsealed) -> None:
    """Write one file atomically; `seal` and errors as for `atomic`."""
    with atomic(path, seal) as hidden:
        hidden.write_bytes(content)


def write_text(text: str, path: Path) -> None:
    """Write one UTF-8 text file atomically; errors as for `atomic`."""
    write_bytes(text.encode("utf-8"), path)


def write_csv(table: pd.DataFrame, path: Path) -> None:
    """Write one CSV file with every digit, atomically; errors as for `atomic`."""
    write_text(csv_of(table), path)


def csv_of(table: pd.DataFrame) -> str:
    """A table as CSV with every digit.

    Pandas alone would print numbers as NumPy's print options say, which other libraries change.
    """
    return table.to_csv(index=False, float_format=_every_digit)


def _every_digit(value: Any) -> str:
    return repr(float(value))


def json_of(data: Mapping[str, Any]) -> str:
    """A mapping as the text of a JSON file, its keys in order."""
    return json.dumps(data, indent=2, sort_keys=True, allow_nan=False) + "\n"


def write_json(data: Mapping[str, Any], path: Path) -> None:
    """Write one JSON file atomically; errors as for `atomic`."""
    write_text(json_of(data), path)


def _write_table(table: pa.Table, where: Any, **options: Any) -> None:
    """Write a Parquet file whose pages carry checksums (CRC-32), which readers can verify."""
    how = {"write_page_checksum": True, "write_batch_size": _ROWS_AT_ONCE, **_encodings(table.schema), **options}
    pq.write_table(table, where, **how)


def encoded(table: pa.Table) -> bytes:
    """A table as the bytes of a Parquet file."""
    sink = pa.BufferOutputStream()
    _write_table(table, sink)
    return bytes(sink.getvalue().to_pybytes())


def decoded(content: bytes, schema: pa.Schema, rows: int) -> pa.Table | None:
    """The table of a Parquet file's bytes; None where they hold no such table of so many rows.

    Nothing but its size and its schema is looked at before these fit, so that no more memory is taken than they need.
    """
    try:
        file = pq.ParquetFile(pa.BufferReader(content), page_checksum_verification=True)
        if file.metadata.num_rows != rows or not file.schema_arrow.equals(schema):
            return None
        table = file.read()
        # What the file says of its rows besides, such as their detours, stays.
        return table.replace_schema_metadata({**(table.schema.metadata or {}), **(schema.metadata or {})})
    except (OSError, pa.ArrowException):
        return None


def _encodings(schema: pa.Schema) -> dict[str, Any]:
    """How columns of a result table are stored, which may have many rows: words as numbers, ids as steps, values as is.

    Dictionaries of measured values, which hardly repeat, take long to make; parameters are compressed as they are.
    """
    if _PARAMETERS.encode() not in (schema.metadata or {}):
        return {}
    words = [field.name for field in schema if pa.types.is_dictionary(field.type)]
    return {"use_dictionary": words, "column_encoding": {"design_id": "DELTA_BINARY_PACKED"}}


def batches(path: Path, columns: Sequence[str] | None = None) -> Iterator[pa.Table]:
    """A Parquet file, or some columns, in tables of a row group each; raises OutputError if missing or damaged."""
    try:
        # Buffered ahead, a whole file would be in memory.
        file = pq.ParquetFile(path, pre_buffer=False, page_checksum_verification=True)
        for batch in file.iter_batches(ROW_GROUP, columns=columns):
            yield pa.Table.from_batches([batch])
    except (OSError, pa.ArrowException) as error:
        raise OutputError(Fault(f"cannot be read: {error}", str(path))) from None


def sliced(path: Path, sizes: Iterable[int]) -> Iterator[pa.Table]:
    """The rows of a Parquet file in tables of these sizes, a row group in memory; raises OutputError when damaged."""
    groups = batches(path)
    rest = None
    for size in sizes:
        while rest is None or rest.num_rows < size:
            more = next(groups, None)
            if more is None:
                raise OutputError(Fault("has too few rows", str(path)))
            rest = more if rest is None else pa.concat_tables([rest, more])
        yield rest.slice(0, size)
        rest = rest.slice(size)


def holds(table: pa.Table, column: str, *words: str) -> BoolArray:
    """Where a column of words (dictionary-encoded) holds one of `words`, ndarray[n_rows]."""
    found = [np.zeros(0, dtype=bool)]
    for chunk in table[column].chunks:
        at = [index for index, word in enumerate(chunk.dictionary.to_pylist()) if word in words]
        found.append(np.isin(which(chunk), at))
    return np.concatenate(found)


def release_memory() -> None:
    """Give memory that Arrow keeps for later back to the system."""
    pa.default_memory_pool().release_unused()


def read_table(path: Path) -> pa.Table:
    """Read a Parquet file; raises OutputError when it is missing or damaged."""
    try:
        return pq.read_table(path, page_checksum_verification=True)
    except (OSError, pa.ArrowException) as error:
        raise OutputError(Fault(f"cannot be read: {error}", str(path))) from None
