"""Tables of digital numbers that a camera read on the bench."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from ...base.errors import DataError, ValidationIssue, nearest
from ...spectra.facts import merge_equal_issues
from ...spectra.read_text import MISSING, Rows, number_of, text_sheet
from ...spectra.units import folded

DARK = "dark"
"""The lamp of readings without light."""


class _Field(NamedTuple):
    """Numbers of a column: factor to its unit, least and most, whether they are whole."""

    name: str
    factor: float = 1.0
    least: float = 0.0
    most: float = np.inf
    whole: bool = False


_WORDS = ("lamp", "channel", "scene")
_FIELDS = {
    "exposure_s": _Field("exposure_s", least=1e-9, most=1e5),
    "exposure_ms": _Field("exposure_s", 1e-3, 1e-9, 1e5),
    "exposure_us": _Field("exposure_s", 1e-6, 1e-9, 1e5),
    "dn": _Field("dn"),
    "dn_dn": _Field("dn"),
    "sigma_dn": _Field("sigma_dn"),
    "pixels": _Field("pixels", least=1, most=1e12, whole=True),
    "frames": _Field("frames", least=1, most=1e9, whole=True),
    "row": _Field("row", whole=True),
    "column": _Field("column", whole=True),
    "irradiance_w/m2": _Field("irradiance_w_m2", least=1e-30, most=1e30),
    "irradiance_w_m2": _Field("irradiance_w_m2", least=1e-30, most=1e30),
    "irradiance_mw/m2": _Field("irradiance_w_m2", 1e-3, 1e-30, 1e30),
    "irradiance_uw/cm2": _Field("irradiance_w_m2", 1e-2, 1e-30, 1e30),
    "irradiance_photons/s/m2": _Field("irradiance_photons", least=1e-30, most=1e30),
}
"""Heads of columns of numbers, with units as `exposure (ms)` or `exposure_ms`."""
_OPTIONAL = ("sigma_dn", "pixels", "frames", "row", "column", "irradiance_w_m2", "irradiance_photons")
_HEAD = "lamp, channel (or row and column in the tile), exposure_s, dn"


def read_readings(readings: Path | str | pd.DataFrame) -> tuple[str, pd.DataFrame]:
    """Return the name of a table, and its readings with the line of each; NaN and "" for what is not said.

    Raises DataError with all faults, each with its line.
    """
    file, rows, decimal = _cells(readings)
    (line, heads), *body = rows
    keys = [re.sub(r"[\s_()\[\]]+", "_", folded(head)).strip("_") for head in heads]
    issues = [*_faults_of_heads(file, line, heads, keys)]
    if not issues and not body:
        issues.append(ValidationIssue("no readings", file, line))
    if issues:
        raise DataError(issues)
    columns: dict[str, list[Any]] = {"line": [number for number, _ in body]}
    for at, key in enumerate(keys):
        cells = [(number, row[at].strip() if at < len(row) else "") for number, row in body]
        if key in _WORDS:
            columns[key] = [cell for _, cell in cells]
            continue
        field = _FIELDS[key]
        values = [_number(cell, decimal) * field.factor for _, cell in cells]
        columns[field.name] = values
        for (number, cell), value in zip(cells, values, strict=True):
            if np.isnan(value) and cell.casefold() in MISSING and field.name in _OPTIONAL:
                continue
            if not field.least <= value <= field.most or (field.whole and value != round(value)):
                what = "a whole number" if field.whole else "a number"
                low = f" from {field.least / field.factor:g}" if np.isfinite(field.least) else ""
                issues.append(ValidationIssue("cannot be used", file, number, heads[at], cell, f"{what}{low} on"))
    table = pd.DataFrame(columns)
    for name in (*_OPTIONAL, *_WORDS):
        table[name] = table.get(name, "" if name in _WORDS else np.nan)
    placeless = (
        (table["channel"] == "") & (table["lamp"].str.casefold() != DARK) & table[["row", "column"]].isna().any(axis=1)
    )
    for name, unsaid in (("lamp", table["lamp"] == ""), ("channel", placeless)):
        issues += [ValidationIssue("missing", file, number, name) for number in table["line"][unsaid]]
    if issues:
        raise DataError(merge_equal_issues(issues))
    return file, table


def _cells(readings: Path | str | pd.DataFrame) -> tuple[str, Rows, str]:
    """Return the name of a table, its rows of cells with their lines, and its decimal mark."""
    if isinstance(readings, pd.DataFrame):
        texts = readings.astype(object).where(readings.notna(), "").to_numpy()
        lines = enumerate(texts, 2)
        return "readings", [(1, [*map(str, readings)]), *((at, [*map(str, row)]) for at, row in lines)], "."
    if not isinstance(readings, str | Path):
        raise DataError(ValidationIssue("no table", value=type(readings).__name__, allowed="a file or a data frame"))
    sheet = text_sheet(Path(readings), f"a head with {_HEAD}, and a row for each reading")
    return sheet.file, sheet.rows, sheet.decimal


def _number(cell: str, decimal: str) -> float:
    value = number_of(cell.replace(decimal, "."))
    return np.nan if value is None else value


def _faults_of_heads(file: str, line: int, heads: Sequence[str], keys: Sequence[str]) -> Iterator[ValidationIssue]:
    known = [*_WORDS, *_FIELDS]
    if unknown := [(head, key) for head, key in zip(heads, keys, strict=True) if key not in known]:
        for head, key in unknown:
            near = nearest(key, known)
            yield ValidationIssue("unknown column", file, line, head or None, None, ", ".join(known), near)
        return
    names = [_FIELDS[key].name if key in _FIELDS else key for key in keys]
    for name in dict.fromkeys(names):
        if names.count(name) > 1:
            yield ValidationIssue("column occurs twice", file, line, name)
    if {"irradiance_w_m2", "irradiance_photons"} <= {*names}:
        yield ValidationIssue("two columns of irradiance", file, line)
    missing = [name for name in ("lamp", "exposure_s", "dn") if name not in names]
    if "channel" not in names and not {"row", "column"} <= {*names}:
        missing.append("channel")
    for name in missing:
        yield ValidationIssue("no such column", file, line, name, None, _HEAD)
