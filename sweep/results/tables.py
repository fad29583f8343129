"""Parquet and JSON on disk: explicit schemas, and how columns are stored."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from ..base.errors import Fault, OutputError
from ..base.types import BoolArray
from .arrays import holds_one_of
from .atomic import Seal, atomic, unsealed, write_text

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
    pa.field("filter_id", pa.int64(), nullable=False),
    *(pa.field(name, _TEXT) for name in ("kind", "name", "space", "cfa", "family", "scenario")),
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


def write_table(table: pa.Table, path: Path, seal: Seal = unsealed) -> None:
    """Write one Parquet file atomically, with a checksum of each page; `seal` and errors as for `atomic`."""
    with atomic(path, seal) as hidden:
        _write_tables([table], hidden, ROW_GROUP)


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


def _write_tables(tables: Sequence[pa.Table], where: Any, most: int | None = None) -> None:
    """Write a Parquet file whose pages carry checksums (CRC-32), which readers can verify.

    `tables`: of one schema, a row group each, or several of `most` rows.
    """
    schema = tables[0].schema
    how = {"write_page_checksum": True, "write_batch_size": _ROWS_AT_ONCE, **_encodings(schema)}
    with pq.ParquetWriter(where, schema, **how) as writer:
        for table in tables:
            writer.write_table(table, most)


def encoded(*tables: pa.Table) -> bytes:
    """Tables of one schema as the bytes of a Parquet file, a row group each."""
    sink = pa.BufferOutputStream()
    _write_tables(tables, sink)
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
    return {
        "use_dictionary": words,
        "column_encoding": dict.fromkeys(("design_id", "filter_id"), "DELTA_BINARY_PACKED"),
    }


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
    return np.concatenate([np.zeros(0, dtype=bool), *(holds_one_of(chunk, words) for chunk in table[column].chunks)])


def release_memory() -> None:
    """Give memory that Arrow keeps for later back to the system."""
    pa.default_memory_pool().release_unused()


def read_table(path: Path) -> pa.Table:
    """Read a Parquet file; raises OutputError when it is missing or damaged."""
    try:
        return pq.read_table(path, page_checksum_verification=True)
    except (OSError, pa.ArrowException) as error:
        raise OutputError(Fault(f"cannot be read: {error}", str(path))) from None
