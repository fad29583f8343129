"""Layouts of tables: wavelengths along a row, or in the words of a list, turned so that they stand down a column."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..base.errors import DataError, ValidationIssue
from .read_text import MISSING, Rows, Sheet, number_of
from .units import folded

WAVELENGTH = "wavelength_nm"
"""Name of the first column of the package's own files."""
_FEWEST_ALONG = 20
_RANGE_NM = (100.0, 20_000.0)
_WAVE = re.compile(
    r"wave ?lengths?|wave|wvl|wl|lambda|\u03bb|wellenlange|wellenlaenge|longueurs? d'onde|longitud(es)? de onda"
    r"|lunghezz[ae] d'onda|comprimentos? de onda"
)
UNITS_NM = {
    **dict.fromkeys(("nm", "nanometer", "nanometers", "nanometre", "nanometres"), 1.0),
    **dict.fromkeys(("um", "micron", "microns", "micrometer", "micrometers", "micrometre"), 1e3),
    **dict.fromkeys(("a", "angstrom", "angstroms"), 0.1),
    "m": 1e9,
}
UNIT_WORDS = {1.0: "nm", 1e3: "um", 0.1: "angstrom", 1e9: "m"}
_NAME_AND_UNIT = re.compile(r"(.*?)[\s_/,.\-]*[\[(]?\s*([^\W\d_]+)\s*[\])]?")
_KEYED = re.compile(r"(.*?[^\d.\s])?\s*(\d+(?:\.\d+)?)\s*[\[(]?\s*(nm)?\s*[\])]?")


def number_in(cell: str, decimal: str) -> float | None:
    """Return a number, also one with a percent sign; NaN for a missing one; None for a text."""
    if cell.casefold() in MISSING:
        return np.nan
    return number_of(cell.replace(decimal, ".").rstrip("%").rstrip())


def rising(values: Sequence[float | None]) -> bool:
    """Return whether numbers rise or fall within the range of wavelengths in nm."""
    known = np.array([np.nan if value is None else value for value in values])
    steps = np.diff(known)
    inside = (known >= _RANGE_NM[0]) & (known <= _RANGE_NM[1])
    return bool(known.size > 1 and inside.all() and ((steps > 0).all() or (steps < 0).all()))


def wave_unit(cell: str) -> float | None:
    """Return the factor from wavelengths under a head to nm; 0 without a unit; None if it is none of wavelengths."""
    text = folded(cell.replace("\u212b", "a").replace("\u00c5", "a").replace("\u00e5", "a")).replace("_", " ")
    if _WAVE.fullmatch(text):
        return 0.0
    match = _NAME_AND_UNIT.fullmatch(text)
    if match is None or match[2] not in UNITS_NM or (not match[1] and len(match[2]) == 1):
        return None
    return UNITS_NM[match[2]] if not match[1] or _WAVE.fullmatch(match[1].removesuffix(" in").strip()) else None


def turned_down(sheet: Sheet) -> Sheet | None:
    """Return a sheet with wavelengths along a row, or in the words of a list, turned; None for others."""
    for index, (line, cells) in enumerate(sheet.rows):
        plain = [_KEYED.fullmatch(cell.replace(sheet.decimal, ".")) for cell in cells]
        at_number = [at for at, match in enumerate(plain) if match is not None]
        if len(at_number) < _FEWEST_ALONG:
            continue
        run = max(np.split(at_number, 1 + np.flatnonzero(np.diff(at_number) != 1)), key=len)
        waves = [float(match[2]) for at in run if (match := plain[at]) is not None]
        at, below = int(run[0]), sheet.rows[index + 1 :]
        if len(waves) < _FEWEST_ALONG or not rising(waves) or not below or _is_down(sheet, cells, below, at):
            break
        turned = [(line, [WAVELENGTH, *(_row_name(row[:at], sheet, k) for k, (_, row) in enumerate(below, 1))])]
        for column, wave in zip(run, waves, strict=True):
            values = [row[column] if column < len(row) else "" for _, row in below]
            turned.append((line, [f"{wave:.12g}".replace(".", sheet.decimal), *values]))
        if (longest := max(below, key=lambda row: len(row[1])))[1][len(cells) :]:
            problem = ValidationIssue(
                "wrong number of columns", sheet.file, longest[0], None, len(longest[1]), str(len(cells))
            )
            raise DataError(problem)
        notes = [*sheet.notes, "wavelengths are along a row: the table was turned"]
        remarks = [*sheet.remarks, *(" ".join(row) for _, row in sheet.rows[:index])]
        return replace(sheet, rows=turned, notes=notes, remarks=remarks)
    return _listed(sheet)


def _is_down(sheet: Sheet, head: Sequence[str], below: Rows, at: int) -> bool:
    """Return whether numbers in a head are names, since wavelengths stand down the column before them.

    Raises DataError where both may be wavelengths.
    """
    before = max(at - 1, 0)
    column = [number_in(row[before], sheet.decimal) if before < len(row) else None for _, row in below]
    if len(column) < 3 or not rising(column):
        return False
    worded = at > 0 and wave_unit(head[before]) is not None
    if at and (not head[before] or (worded and len(column) < _FEWEST_ALONG)):
        allowed = "names that are no numbers"
        raise DataError(ValidationIssue("wavelengths down or along?", sheet.file, below[0][0], allowed=allowed))
    return at == 0 or worded


def _row_name(cells: Sequence[str], sheet: Sheet, number: int) -> str:
    """Return the name of a row: its texts before the numbers, else its number."""
    texts = [cell for cell in cells if cell and number_in(cell, sheet.decimal) is None]
    return " ".join(texts) or (cells[0] if cells and cells[0] else f"curve_{number}")


def _listed(sheet: Sheet) -> Sheet | None:
    """Return a list of `Spectral Data 380[nm],0.001` as a table."""
    series: dict[str, list[tuple[int, list[str]]]] = {}
    names: list[str] = []
    for line, cells in sheet.rows:
        match = _KEYED.fullmatch(cells[0])
        if (
            match is not None
            and (match[1] or match[3])
            and len(cells) > 1
            and number_in(cells[1], sheet.decimal) is not None
        ):
            series.setdefault(match[1] or "", []).append((line, [match[2], *cells[1:]]))
        elif folded(cells[0]) in ("title", "name", "sample", "sample name", "titel") and len(cells) > 1:
            names = cells[1:]
    found = [
        rows for rows in series.values() if len(rows) >= _FEWEST_ALONG and rising([float(row[0]) for _, row in rows])
    ]
    if not found:
        return None
    rows = max(found, key=len)
    count = max(len(row) for _, row in rows) - 1
    names = (
        names
        if len(names) == count
        else [sheet.name or "values"]
        if count == 1
        else [f"curve_{k + 1}" for k in range(count)]
    )
    table = [
        (rows[0][0], [WAVELENGTH, *names]),
        *((n, [row[0].replace(".", sheet.decimal), *row[1:]]) for n, row in rows),
    ]
    others = [" ".join(cells) for _, cells in sheet.rows if _KEYED.fullmatch(cells[0]) is None]
    note = "wavelengths are in the words of a list"
    return replace(sheet, rows=table, notes=[*sheet.notes, note], remarks=[*sheet.remarks, *others])
