"""Rows of cells as curves: where the wavelengths are, which cells are names and units, and numbers that are cleaned.

Wavelengths stand down the first column, or in one beside each curve, or along a row; a list may have them in its words.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..base.errors import DataError, ValidationIssue
from ..base.types import Array, Float, PerWavelength
from .clean import Cleaner
from .heads import Series, Table, counting, heads_of, steps_by_one, table_units, wave_columns
from .layouts import (
    MOST_TITLES,
    UNIT_WORDS,
    WAVELENGTH,
    number_in,
    refuse_other_axis,
    turned_down,
    wave_unit,
)
from .read_text import Sheet
from .spectrum import LARGEST, Unit, sample_issues
from .units import folded, symbol_unit, unit_of

MOST_CURVES = 2_000
MOST_SAMPLES = 100_000
MOST_VALUES = 2_000_000
"""Limits of a file of curves: 2,000 curves of 1,000 samples are read in some seconds."""
_AXIS = re.compile(r"\W*x[\s_-]?(?:axis ?(?:units?|mode)?|units?|mode)\b\W*(.*)")
_MOST_CELL_FAULTS = 10_000
_Y = re.compile(r"(y(_?\d+)?|values?)|")
_INDEX = ("", "#", "no", "no.", "nr", "nr.", "n", "id", "index", "row", "pixel", "unnamed: 0")
_SPREAD = re.compile(
    r"\b(std( ?dev)?|stdev|standard deviation|sigma|(expanded )?uncertainty|u95|rsd|unsicherheit|standardabweichung)\b"
    r"|^u\(|^(saturated|flag)\b"
)
"""Heads of columns that are no curves."""
_NOISE_OD = 0.05
"""Negatives of optical densities that are noise of the baseline."""
_LEAST_UNLIKELY_NM = 2500.0
_MOST_UM = 1.65
"""Largest wavelength without a unit that is taken for um: from 1.65 eV on, light is visible."""


@dataclass(frozen=True)
class Scan:
    """File of curves, read as far as possible.

    `values`: NaN beyond the samples of a curve, and for what is none. `issues` in groups:
    `read_curves` stops at the first.
    """

    wavelength_nm: PerWavelength
    names: tuple[str, ...]
    values: Float[Array, "places functions"]
    units: tuple[Unit, ...]
    issues: tuple[tuple[ValidationIssue, ...], ...]
    notes: tuple[str, ...] = ()


class _Column(NamedTuple):
    """A curve in a table: its name, unit, and the columns of its wavelengths and values."""

    name: str
    unit: Unit
    wave: int
    at: int


def curves_of(sheet: Sheet) -> Scan:
    """Return the curves of a sheet. Raises DataError where there is no table."""
    width = max((at + 1 for _, cells in sheet.rows for at, cell in enumerate(cells) if cell), default=0)
    if any(len(cells) > width for _, cells in sheet.rows):
        sheet.notes.append("empty columns at the end were left out")
    sheet = replace(sheet, rows=[(line, cells[:width]) for line, cells in sheet.rows])
    refuse_other_axis(sheet.file, None, sheet.axis)
    texts = [(None, remark) for remark in sheet.remarks]
    for line, text in [*texts, *((line, " ".join(cells)) for line, cells in sheet.rows[:MOST_TITLES])]:
        if (stated := _AXIS.match(folded(text))) is not None:
            refuse_other_axis(sheet.file, line, stated[1])
    table = _table_of(turned_down(sheet) or sheet)
    columns = _columns(table)
    check_size(sheet.file, None, len(table.body), len(columns))
    numbers, bad, in_percent = _numbers(table, columns)
    plain = [c._replace(unit=replace(c.unit, factor=1.0)) if c.at in in_percent else c for c in columns]
    return _scan(table, plain, numbers, bad)


def _table_of(sheet: Sheet) -> Table:
    """Split a sheet into the rows of numbers and the texts above them. DataError for none, or two tables."""
    parsed = [[number_in(cell, sheet.decimal) for cell in cells] for _, cells in sheet.rows]
    shares = []
    for numbers in parsed:
        count = sum(number is not None and number == number for number in numbers)  # noqa: PLR0124  (NaN: missing)
        shares.append((count, count / max(count + sum(number is None for number in numbers), 1)))
    numeric_rows = [at for at, (count, share) in enumerate(shares) if count > 1 and share == 1]
    numeric_rows = numeric_rows or [at for at, (count, share) in enumerate(shares) if count > 1 and share >= 0.5]
    empty = ValidationIssue(
        "no rows of numbers", sheet.file, allowed="a header `wavelength_nm,...` and rows of numbers"
    )
    if not numeric_rows:
        if sheet.rows and len(sheet.rows[0][1]) == 1 and wave_unit(sheet.rows[0][1][0]) is not None:
            raise DataError(
                ValidationIssue(
                    "the file has no curve",
                    sheet.file,
                    sheet.rows[0][0],
                    allowed="one column or more beside the wavelength",
                )
            )
        raise DataError(empty)
    blocks: list[list[int]] = [[]]
    for at in range(numeric_rows[0], numeric_rows[-1] + 1):
        if shares[at][0] == 0 and len(sheet.rows[at][1]) == 1:
            blocks.append([])
        else:
            blocks[-1].append(at)
    block = max(blocks, key=lambda rows: sum(shares[at][1] == 1 for at in rows))
    others = [rows for rows in blocks if rows is not block and 5 * len(rows) > len(block) and len(rows) > 1]
    if others:
        line = sheet.rows[others[0][0]][0]
        raise DataError(ValidationIssue("two tables in one file", sheet.file, line, allowed="one table"))
    first, last = block[0], block[-1]
    while first and shares[first - 1][1] >= 0.5 and not _is_head(sheet.rows[first - 1][1]):
        first -= 1
    while last + 1 < len(sheet.rows) and shares[last + 1][1] >= 0.5:
        last += 1
    body = sheet.rows[first : last + 1]
    widths = [len(cells) for _, cells in body]
    width = max(set(widths), key=widths.count)
    table = Table(sheet, sheet.rows[:first], body, parsed[first : last + 1], width)
    if table.head and len(table.head[-1][1]) > width and any(wave_unit(c) is not None for c in table.head[-1][1]):
        table.width = len(table.head[-1][1])  # columns that are empty at the end of rows
    return table


def _is_head(cells: Sequence[str]) -> bool:
    return any(wave_unit(cell) is not None for cell in cells) or not cells[0]


def _columns(table: Table) -> list[_Column]:
    """Return the curves of a table from its heads, units and numbers; adds issues where they are unclear."""
    heads = heads_of(table)
    names, at_x = heads.names, wave_columns(table, heads)
    pairs = len(at_x) > 1
    titled = heads.titles[-1][1] if heads.titles and pairs else []
    of_table, loose = table_units(table, heads.titles)
    others = [at for at in range(table.width) if at not in at_x]
    left_out = _left_out(table.sheet, names, table.series, others, at_x)
    columns: list[_Column] = []
    for at in (at for at in others if at not in left_out):
        wave = max((x for x in at_x if x < at), default=at_x[0])
        name = _curve_name(names, titled, wave, at, pairs)
        unit = unit_of(names[at]).over(unit_of(name)) if names else Unit()
        stated = symbol_unit(heads.units[at]) or unit_of(heads.units[at])
        if heads.units[at] and not stated.words:
            stated = Unit(heads.units[at], unclear="has an unknown unit")
        above = [cells[at] for _, cells in heads.titles if not cells[0] and at < len(cells) and not titled]
        for other in (stated, *map(unit_of, above), of_table):
            unit = unit.over(other)
        unit = unit if unit.quantity or unit.unclear else unit.over(loose)
        columns.append(_Column(name or ("" if names else _made_name(table, len(columns), at_x)), unit, wave, at))
    used = {at_x[0], *(column.at for column in columns)}
    for below, cells in table.between:
        if given := [cell for at, cell in enumerate(cells) if cell and at in used]:
            table.fault("neither heads, units nor numbers", below, None, given[0], "one row of heads, one of units")
    _check_names(table, heads.line, names, columns, numbered=pairs)
    return _numbered(columns) if pairs else columns


def _left_out(
    sheet: Sheet, names: Sequence[str], series: Sequence[Series], others: Sequence[int], at_x: Sequence[int]
) -> list[int]:
    """Return columns that are no curves: that count the rows, without numbers, of deviations; with a note on each."""
    index = [at for at in others if len(at_x) == 1 and _counts(names, series, at, at_x[0])]
    if index:
        sheet.notes.append("a column that counts the rows was left out")
    texts = [at for at in others if all(value is None or np.isnan(value) for value in series[at])]
    spreads = [at for at in others if names and _SPREAD.search(folded(names[at]).replace("_", " "))]
    for what, columns in (("without numbers", texts), ("of deviations", spreads)):
        if columns and len(columns) < len(others):
            named = ", ".join(repr(names[at]) for at in columns if names and names[at])
            sheet.notes.append(f"columns {what} were left out{f': {named}' if named else ''}")
            index += columns
    return index


def _made_name(table: Table, before: int, at_x: Sequence[int]) -> str:
    return (table.sheet.name or "values") if table.width - len(at_x) == 1 else f"curve_{before + 1}"


def _counts(names: Sequence[str], series: Sequence[Series], at: int, wave: int) -> bool:
    """Return whether a column holds the numbers of the rows: it has no name, or is called so."""
    named = not names or folded(names[at]) in _INDEX
    counts = counting(series[at]) or (bool(names) and not names[at] and steps_by_one(series[at]))
    return named and counts and (at < wave or (bool(names) and not names[at]))


def _curve_name(names: Sequence[str], titled: Sequence[str], wave: int, at: int, pairs: bool) -> str:
    """Return the name of a column: its head, or of a pair the text above it."""
    head = names[at] if names else ""
    if not pairs:
        return head
    above = next((titled[k] for k in (wave, at) if k < len(titled) and titled[k]), "")
    if above:
        return above
    stem = re.sub(r"[\s_\-.]*\by\b|_y$", "", head, flags=re.IGNORECASE).strip()
    return "" if _Y.fullmatch(folded(head)) else stem or head


def _check_names(
    table: Table, line: int | None, names: Sequence[str], columns: Sequence[_Column], *, numbered: bool
) -> None:
    file = table.sheet.file
    if not columns:
        table.issues.append(
            ValidationIssue("the file has no curve", file, line, allowed="one column or more beside the wavelength")
        )
    if numbered or not names or table.issues:
        return
    twice = [column.name for at, column in enumerate(columns) if column.name in [other.name for other in columns[:at]]]
    table.issues += [ValidationIssue("column occurs twice", file, line, name) for name in twice if name]
    if any(not column.name for column in columns):
        table.issues.append(ValidationIssue("a column has no name", file, line, value=list(names)))


def _numbered(columns: Sequence[_Column]) -> list[_Column]:
    """Give columns without a name of their own numbers."""
    known: list[_Column] = []
    for number, column in enumerate(columns, 1):
        name = (
            column.name
            if column.name and column.name not in [earlier.name for earlier in known]
            else f"{column.name or 'curve'}_{number}"
        )
        known.append(column._replace(name=name))
    return known


def _numbers(table: Table, columns: Sequence[_Column]) -> tuple[Float[Array, "rows width"], set[int], list[int]]:
    """Return the numbers of a table, NaN for missing ones, and columns with faults, with % signs."""
    keys = {column.wave: WAVELENGTH for column in columns} | {column.at: column.name for column in columns}
    values, bad = np.full((len(table.body), table.width), np.nan), set[int]()
    percent = dict.fromkeys(keys, 0)
    waves = {column.wave for column in columns}
    pairs = waves if len(waves) > 1 else set()  # rows may end after any of several curves
    for index, ((line, row), parsed) in enumerate(zip(table.body, table.parsed, strict=True)):
        if len(table.issues) >= _MOST_CELL_FAULTS:
            table.fault("too many errors; the rest was not read", line, None, None)
            break
        if len(row) != table.width and len(row) not in pairs:
            table.fault("wrong number of columns", line, None, len(row), str(table.width))
            bad |= keys.keys()
            continue
        for at, key in keys.items():
            number = parsed[at] if at < len(parsed) else np.nan
            if number is None:
                comma = "; a decimal comma? use a point" if re.fullmatch(r"[+-]?\d*,\d+", row[at]) else ""
                table.fault("not a usable number", line, key, row[at], f"a finite number{comma}")
                bad.add(at)
            elif number > LARGEST:
                table.fault("value too large", line, key, row[at], f"0 to {LARGEST:g}")
                bad.add(at)
            else:
                values[index, at] = number
                percent[at] += at < len(row) and row[at].endswith("%")
    for at, count in percent.items():
        given = int(np.isfinite(values[:, at]).sum())
        if 0 < count < given:
            table.fault("some values have percent signs", None, keys[at], f"{count} of {given}", "all or none")
    signed = [at for at, count in percent.items() if count]
    if signed:
        values[:, signed] *= 0.01
        table.sheet.notes.append("values have percent signs, and were divided by 100")
    return values, bad, signed


def _scan(table: Table, columns: Sequence[_Column], numbers: Float[Array, "rows columns"], bad: set[int]) -> Scan:
    """Bring curves to nm, order and common wavelengths, and clean them of what has one meaning."""
    sheet = table.sheet
    factor = table.factor_nm
    waves = {column.wave: numbers[:, column.wave] for column in columns}
    if not waves:
        factor = 1.0
    if not factor:
        largest = max((float(np.nanmax(wave)) for wave in waves.values() if np.isfinite(wave).any()), default=0.0)
        factor = 1e9 if 0 < largest < 1e-4 else 1e3 if 0 < largest < 20 else 1.0
        if factor == 1e3 and largest > _MOST_UM:
            table.fault("wavelengths have no unit: um, or energies in eV?", None, None, largest, "a head with the unit")
        sheet.notes.append(f"wavelengths have no unit, and were taken for {UNIT_WORDS[factor]} by their size")
    elif factor != 1:
        sheet.notes.append(f"wavelengths in {UNIT_WORDS[factor]} were brought to nm")
    nm = {at: wave if factor == 1 else np.round(wave * factor, 6) for at, wave in waves.items()}
    lowest = min((float(np.nanmin(wave)) for wave in nm.values() if np.isfinite(wave).any()), default=0.0)
    if lowest >= _LEAST_UNLIKELY_NM:
        problem = "no wavelength that a camera sees: angstrom, or wavenumbers in 1/cm?"
        allowed = "a head with the unit of wavelengths"
        raise DataError(ValidationIssue(problem, sheet.file, value=f"{lowest:g} nm and more", allowed=allowed))
    cleaner = Cleaner(sheet.file, table.issues)
    curves = []
    for column in columns:
        wave, values = nm[column.wave], numbers[:, column.at]
        faulty = bool(bad & {column.wave, column.at})
        if (np.isnan(wave) & np.isfinite(values)).any() and not faulty:
            row = int(np.flatnonzero(np.isnan(wave) & np.isfinite(values))[0])
            table.fault("a value without a wavelength", table.body[row][0], column.name, float(values[row]))
        noise = {"decibel": np.inf, "density": _NOISE_OD}.get(column.unit.quantity or "", 0.0)
        curves.append(cleaner.cleaned(column.name, wave, values, noise=noise, faulty=faulty))
    sheet.notes.extend(cleaner.notes)
    grid = np.unique(np.concatenate([wave for wave, _ in curves])) if curves else np.empty(0)
    check_size(sheet.file, None, grid.size, len(curves))
    values = np.full((grid.size, len(curves)), np.nan)
    for at, (wave, own) in enumerate(curves):
        if wave.size:
            values[:, at] = own if wave.size == grid.size else np.interp(grid, wave, own, np.nan, np.nan)
    names = tuple(column.name for column in columns)
    in_db = {at for at, column in enumerate(columns) if column.unit.quantity == "decibel"}
    groups = [table.issues] if table.issues else sample_issues(sheet.file, grid, names, values, in_db)
    return Scan(
        grid,
        names,
        values,
        tuple(c.unit for c in columns),
        tuple(map(tuple, groups)),
        tuple(dict.fromkeys(sheet.notes)),
    )


def check_size(file: str, line: int | None, n_samples: int, n_curves: int) -> None:
    """Raise DataError for a table that would take minutes to read."""
    for what, count, most in (
        ("curves", n_curves, MOST_CURVES),
        ("samples", n_samples, MOST_SAMPLES),
        ("values", n_samples * n_curves, MOST_VALUES),
    ):
        if count > most:
            raise DataError(
                ValidationIssue(f"too many {what} in one file", file, line, None, count, f"at most {most:,}")
            )
