"""Layouts of tables: wavelengths along a row, or in the words of a list, turned so that they stand down a column."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..base.errors import DataError, ValidationIssue
from ..base.types import IndexArray
from .clean import several
from .read_text import MISSING, Rows, Sheet, number_of
from .units import folded

WAVELENGTH = "wavelength_nm"
"""Name of the first column of the package's own files."""
_FEWEST_ALONG = 20
MOST_TITLES = 100
"""Rows above one of wavelengths."""
_RANGE_NM = (100.0, 20_000.0)
_WAVE = re.compile(
    r"wave ?lengths?|wavelenghts?|wave|wvl|wvlgth|wl|lambda|\u03bb|wellenlange|wellenlaenge|longueurs? d'onde"
    r"|longitud(es)? de onda|lunghezz[ae] d'onda|comprimentos? de onda|vaglangd|golflengte|\u6ce2\u9577|\u6ce2\u957f"
)
_NO_WAVE = re.compile(r"\b(frequency|frequenz|freq|wave ?numbers?|wellenzahl|raman|[tg]hz|ev|cm 1|1 cm|energy)\b")
"""Words of what is along a spectrum in the place of wavelengths."""
_MOST_LETTERS = 80
"""Letters of a head of wavelengths."""
UNITS_NM = {
    **dict.fromkeys(("nm", "nanometer", "nanometers", "nanometre", "nanometres"), 1.0),
    **dict.fromkeys(("um", "micron", "microns", "micrometer", "micrometers", "micrometre"), 1e3),
    **dict.fromkeys(("a", "angstrom", "angstroms"), 0.1),
    "m": 1e9,
}
UNIT_WORDS = {1.0: "nm", 1e3: "um", 0.1: "angstrom", 1e9: "m"}
_PREFIX = re.compile(r"|nm|x|wl?|wvl|lambda|.*(spectral|radiance|wavelength).*")
"""What may stand before wavelengths in heads."""
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
    if len(cell) > _MOST_LETTERS:
        return None
    words = re.sub(r"[\s_/,.\-\[\](){}:]+", " ", folded(cell)).split()
    if words and words[-1] in ("air", "vacuum"):
        words.pop()
    if _WAVE.fullmatch(" ".join(words)):
        return 0.0
    if not words or words[-1] not in UNITS_NM or (len(words) == 1 and len(words[0]) == 1):
        return None
    named = " ".join(words[:-1]).removesuffix(" in")
    return UNITS_NM[words[-1]] if not named or _WAVE.fullmatch(named) else None


def refuse_other_axis(file: str, line: int | None, words: str) -> None:
    """Raise DataError if words name something else than wavelengths."""
    plain = re.sub(r"[^\w]+", " ", folded(words[:_MOST_LETTERS])).strip()
    if _NO_WAVE.search(plain):
        raise DataError(
            ValidationIssue("a spectrum over something else than wavelengths", file, line, None, words, "nm, um")
        )


def wave_unit_of_word(cell: str) -> bool:
    """Return whether a cell names wavelengths by a word, not by their unit alone."""
    return wave_unit(cell) is not None and folded(cell).strip("[]() ") not in UNITS_NM


def turned_down(sheet: Sheet) -> Sheet | None:
    """Return a sheet with wavelengths along a row, or in the words of a list, turned; None for others."""
    for index, (line, cells) in enumerate(sheet.rows[:MOST_TITLES]):
        if len(cells) < _FEWEST_ALONG:
            continue
        found = [_keyed(cell, sheet.decimal) for cell in cells]
        prefixes = [match[0] for match in found if match is not None]
        fitting = {prefix for prefix in set(prefixes) if _PREFIX.fullmatch(folded(prefix))}
        prefixes = [prefix for prefix in prefixes if prefix in fitting]
        if len(prefixes) < _FEWEST_ALONG:
            continue
        usual = max(set(prefixes), key=prefixes.count)
        alike = [at for at, match in enumerate(found) if match is not None and match[0] == usual]
        corner = cells[alike[0] - 1] if alike[0] else ""
        factor = wave_unit(corner) or 1.0
        alike = [at for at in alike if _RANGE_NM[0] <= (found[at] or ("", 0.0))[1] * factor <= _RANGE_NM[1]]
        runs: list[IndexArray] = np.split(np.array(alike, dtype=np.intp), 1 + np.flatnonzero(np.diff(alike) != 1))
        run = max(runs, key=len)
        waves = [match[1] for at in run if (match := found[at]) is not None]
        below = sheet.rows[index + 1 :]
        if len(waves) < _FEWEST_ALONG or not rising([wave * factor for wave in waves]) or not below:
            continue
        at = int(run[0])
        if _is_down(sheet, cells, below, at):
            break
        refuse_other_axis(sheet.file, line, corner)
        if (longest := max(below, key=lambda row: len(row[1])))[1][len(cells) :]:
            problem, count = "wrong number of columns", len(longest[1])
            raise DataError(ValidationIssue(problem, sheet.file, longest[0], None, count, str(len(cells))))
        first = corner if wave_unit(corner) is not None else WAVELENGTH
        turned = [(line, [first, *(_row_name(row[:at], sheet, k) for k, (_, row) in enumerate(below, 1))])]
        for column, wave in zip(run, waves, strict=True):
            values = [row[column] if column < len(row) else "" for _, row in below]
            turned.append((line, [f"{wave:.12g}".replace(".", sheet.decimal), *values]))
        others = [cell for k, cell in enumerate(cells[at:], at) if k not in set(run) and cell]
        notes = [*sheet.notes, "wavelengths are along a row: the table was turned"]
        notes += [f"columns beside the wavelengths were left out: {several(others)}"] if others else []
        remarks = [*sheet.remarks, *(" ".join(row) for _, row in sheet.rows[:index]), *([corner] if corner else [])]
        return replace(sheet, rows=turned, notes=notes, remarks=remarks)
    return _listed(sheet)


def _keyed(cell: str, decimal: str) -> tuple[str, float] | None:
    """Return the words before the wavelength in a cell like `Spectral Data 380[nm]`, and it; None for others."""
    match = _KEYED.fullmatch(cell.replace(decimal, ".")) if len(cell) <= _MOST_LETTERS else None
    return None if match is None else (match[1] or ("" if match[3] is None else "nm"), float(match[2]))


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
    """Return the longest list of `Spectral Data 380[nm],0.001` as a table."""
    series: list[tuple[str, list[tuple[int, list[str]]]]] = []
    names: list[str] = []
    for line, cells in sheet.rows:
        key = _keyed(cells[0], sheet.decimal)
        if key is not None and key[0] and len(cells) > 1 and number_in(cells[1], sheet.decimal) is not None:
            row = (line, [f"{key[1]:.12g}", *cells[1:]])
            if not series or series[-1][0] != key[0] or float(series[-1][1][-1][1][0]) >= key[1]:
                series.append((key[0], []))
            series[-1][1].append(row)
        elif folded(cells[0]) in ("title", "name", "sample", "sample name", "titel") and len(cells) > 1:
            names = cells[1:]
    found = [rows for _, rows in series if len(rows) >= _FEWEST_ALONG and rising([float(row[0]) for _, row in rows])]
    if not found:
        return None
    rows = max(found, key=len)
    count = max(len(row) for _, row in rows) - 1
    if len(names) != count:
        names = [sheet.name or "values"] if count == 1 else [f"curve_{k + 1}" for k in range(count)]
    table = [(rows[0][0], [WAVELENGTH, *names])]
    table += [(n, [row[0].replace(".", sheet.decimal), *row[1:]]) for n, row in rows]
    others = [" ".join(cells) for _, cells in sheet.rows if _keyed(cells[0], sheet.decimal) is None]
    note = "wavelengths are in the words of a list"
    return replace(sheet, rows=table, notes=[*sheet.notes, note], remarks=[*sheet.remarks, *others])
