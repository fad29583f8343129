"""Parquet and JSON on disk: explicit schemas and storage of columns."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from ..base.errors import OutputError, ValidationIssue
from ..base.types import Bool, BoolArray
from ..features import gathered
from ..metrics.quantity import UPPER_BOUND
from ..study.inputs import INPUTS
from .atomic import atomic

if TYPE_CHECKING:
    import pandas as pd

SCHEMA_VERSION = "4"
RGGB = "RGGB"
"""The plain CFA that others are compared with, where a study has it."""
RESULTS, DESIGNS, PARETO = "results.parquet", "designs.parquet", "pareto.parquet"
SEARCH_LOG, FRONT = "search.parquet", "search_front.parquet"
CURVES, POINTS = "curves.parquet", "points.parquet"
LIMITED_BY, SATURATED = "limited_by.parquet", "saturated.parquet"
CROSSINGS, WORST, HANDOVERS = "crossings.parquet", "worst.parquet", "handovers.parquet"
COMBINATIONS = "combinations.parquet"
PROVENANCE = "provenance.json"
RESOLVED = "study.resolved.yaml"
MANIFEST = "manifest.json"
REPORT = "report.html"
_OF_CORE = frozenset(
    (
        *(DESIGNS, PARETO, SEARCH_LOG, FRONT, CURVES, POINTS, LIMITED_BY, SATURATED, CROSSINGS, WORST, HANDOVERS),
        *(COMBINATIONS, PROVENANCE, RESOLVED, INPUTS),
    )
)
_DRAWN = re.compile(r"report\.html|(sensors|cfas|pareto)\.(png|svg)|pareto-\d+\.svg")
_OF_ROWS = re.compile(rf"{re.escape(RESULTS)}(/part-\d{{8}}\.parquet)?")
_PARAMETERS = "cfa_sweep_parameters"
_ROWS_AT_ONCE = 65_536
"""That PyArrow encodes; columns of one word take less time so than with its own 1,024."""
_TEXT = pa.dictionary(pa.int32(), pa.string())
_KEYS = (
    pa.field("design_id", pa.int64(), nullable=False),
    pa.field("filter_id", pa.int64(), nullable=False),
    *(pa.field(name, _TEXT) for name in ("kind", "name", "space", "cfa", "family", "scenario")),
)
_SERIES = (pa.field("series", _TEXT), pa.field("key", _TEXT), pa.field("value", pa.float64()))
_VERDICTS = (
    pa.field("violation", pa.float64()),
    pa.field("feasible", pa.bool_()),
    pa.field("simulation_key", _TEXT),
    pa.field("omitted_effects_bound_dn", pa.float64()),
    pa.field("status", _TEXT),
)
OF_SEARCH = (UPPER_BOUND, "gap")
"""Columns of the answers of a search."""
ON_FRONT = "pareto"
"""Column of the rows that a report shows."""
ROW_COLUMNS = tuple(one.name for one in (*_KEYS, *_VERDICTS))
"""Columns of every result table; parameters and quantities stand between the keys and the verdicts."""
REFERENCE, NAMED, SWEPT, SEARCHED = "reference", "design", "sweep", "search"
"""Kinds of rows: a plain CFA, a named design, one that was swept, the search's answer."""
NAMED_KINDS = (REFERENCE, NAMED, SEARCHED)
"""Kinds of which there are few rows."""


@lru_cache(maxsize=1)
def made_by_run() -> frozenset[str]:
    """Return the files that a run itself writes beside its rows; the report draws from them."""
    return _OF_CORE.union(gathered("FILES"))


def is_drawn(name: str) -> bool:
    """Return whether a file belongs to the report."""
    return _DRAWN.fullmatch(name) is not None or name in gathered("DRAWN")


def is_of_run(name: str) -> bool:
    """Return whether a name is one that commands give to files of a run, beside its manifest."""
    known = name in made_by_run() or name in gathered("ADDED") or is_drawn(name)
    return known or _OF_ROWS.fullmatch(name) is not None


def result_schema(
    parameters: Sequence[str],
    quantities: Sequence[str],
    *,
    searched: bool,
    marked: bool = False,
    axes: Sequence[str] = (),
) -> pa.Schema:
    """Return the columns of rows.

    `axes`: dotted keys of `each`; `searched`: with those of the answers of a search; `marked`: with `pareto`.
    """
    numbers = (*parameters, *quantities, *(OF_SEARCH if searched else ()))
    places = [*_SERIES, *(pa.field(name, pa.float64()) for name in axes)] if axes else []
    fields = [*_KEYS, *places, *(pa.field(name, pa.float64()) for name in numbers), *_VERDICTS]
    if marked:
        fields.append(pa.field(ON_FRONT, pa.bool_()))
    return pa.schema(fields, metadata={"cfa_sweep_schema": SCHEMA_VERSION, _PARAMETERS: json.dumps(list(parameters))})


def search_schema(parameters: Sequence[str]) -> pa.Schema:
    """Return the columns of the search's log: one row per evaluation of the smooth response.

    `sensitivity_min` is the level of the front that the evaluation belongs to; null in the search itself.
    """
    text, number = pa.dictionary(pa.int32(), pa.string()), pa.float64()
    fields = [pa.field("scenario", text), pa.field("sensitivity_min", number)]
    fields += [pa.field("start", pa.int32()), pa.field("evaluation", pa.int32())]
    names = (*parameters, "objective", "sensitivity", "cfa_sensitivity", "violation")
    fields += [pa.field(name, number) for name in names]
    return pa.schema([*fields, pa.field("status", text)], metadata={"cfa_sweep_schema": SCHEMA_VERSION})


def front_schema(parameters: Sequence[str]) -> pa.Schema:
    """Return the columns of the trade-off of the search: one row per level of sensitivity.

    `cfa_sensitivity_min` is the same level for the whole CFA; null if several channels are modified.
    """
    number = pa.float64()
    names = (
        "sensitivity_min",
        "cfa_sensitivity_min",
        "objective",
        "sensitivity",
        "cfa_sensitivity",
        "upper_bound",
        "gap",
    )
    fields = [pa.field(name, number) for name in (*names, *parameters)] + [pa.field("evaluations", pa.int64())]
    return pa.schema(fields, metadata={"cfa_sweep_schema": SCHEMA_VERSION})


def write_table(table: pa.Table, path: Path) -> None:
    """Write one Parquet file atomically, with a checksum of each page."""
    with atomic(path) as hidden:
        pq.write_table(table, hidden, **_how(table.schema))


def csv_of(table: pd.DataFrame) -> str:
    """Return a table as CSV with every digit, whatever NumPy's print options are."""
    return table.to_csv(index=False, float_format=lambda value: repr(float(value)))  # type: ignore[arg-type]


def json_of(data: Mapping[str, Any]) -> str:
    """Return a mapping as JSON with sorted keys."""
    return json.dumps(data, indent=2, sort_keys=True, allow_nan=False) + "\n"


def encoded(table: pa.Table) -> bytes:
    """Return a table as the bytes of a Parquet file."""
    sink = pa.BufferOutputStream()
    pq.write_table(table, sink, **_how(table.schema))
    return bytes(sink.getvalue().to_pybytes())


def _how(schema: pa.Schema) -> dict[str, Any]:
    """Return the settings of the Parquet writer: pages carry checksums (CRC-32), which readers verify.

    In result tables words are dictionary-encoded, ids delta-encoded, and values plain, since they hardly repeat.
    """
    how: dict[str, Any] = {"write_page_checksum": True, "write_batch_size": _ROWS_AT_ONCE}
    if _PARAMETERS.encode() in (schema.metadata or {}):
        how["use_dictionary"] = [field.name for field in schema if pa.types.is_dictionary(field.type)]
        how["column_encoding"] = dict.fromkeys(("design_id", "filter_id"), "DELTA_BINARY_PACKED")
    return how


def word_mask(table: pa.Table, column: str, *words: str) -> Bool[BoolArray, " rows"]:
    """Return where a dictionary-encoded column holds one of some words."""
    return np.asarray(pc.is_in(table[column].cast(pa.string()), pa.array(words)).to_numpy(), dtype=bool)


def read_table(path: Path, columns: Sequence[str] | None = None) -> pa.Table:
    """Read a Parquet file; `columns`: some of its columns.

    Raises OutputError if it is missing or damaged.
    """
    try:
        return pq.ParquetFile(path, page_checksum_verification=True).read(columns)
    except (OSError, pa.ArrowException) as error:
        raise OutputError(ValidationIssue(f"cannot be read: {error}", str(path))) from None
