"""Tables of text as instruments and spreadsheets write them; ambiguous ones are refused."""

from __future__ import annotations

import codecs
import csv
import io
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..base.disk import read_input
from ..base.errors import DataError, ValidationIssue
from ..base.types import FloatArray
from .cells import distinct, number_of, unit_by_size
from .spectrum import LARGEST, sample_issues

WAVELENGTH = "wavelength_nm"
"""Name of the first column of the package's own files."""
MOST_BYTES = 40_000_000
MOST_CURVES = 2_000
MOST_SAMPLES = 100_000
MOST_VALUES = 2_000_000
"""Limits of a file of curves: 2,000 curves of 1,000 samples are read in a second or two."""
_COMMENTS = ("#", "%", "//")
_BEGIN = re.compile(r">{3,}begin.*<{3,}|\[data\]", re.IGNORECASE)
_END = re.compile(r">{3,}end.*<{3,}|\[endoffile\]|\[end.*\]", re.IGNORECASE)
"""Marks of spectrometers: `>>>>>Begin Spectral Data<<<<<` (Ocean), `[Data]` (Thorlabs)."""
_MARKS = {"\t": "tabs", ";": "semicolons", ",": "", " ": "blanks"}
_RELEVANT = 50
"""Lines that say how a table is laid out."""
_UTF_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
_CONTROLS = re.compile(rb"[\x01-\x08\x0e-\x19\x1c-\x1f]")
"""Control bytes: spreadsheets, archives and pictures have them, and NULs, within the first few bytes."""
_BEGINNING_BYTES = 4096
_WORDS = (
    *("wavelength", "wavelengths", "wave length", "wave", "wvl", "wl", "lambda", "\u03bb"),
    *("wellenl\u00e4nge", "wellenlaenge", "longueur d'onde", "longitud de onda", "lunghezza d'onda"),
    "comprimento de onda",
)
_UNITS_NM = {
    **dict.fromkeys(("nm", "nanometer", "nanometers", "nanometre", "nanometres"), 1.0),
    **dict.fromkeys(("um", "\u00b5m", "\u03bcm", "micron", "microns", "micrometer", "micrometers"), 1e3),
    **dict.fromkeys(("\u00e5", "angstrom", "angstroms"), 0.1),
    "m": 1e9,
}
_UNIT_WORDS = {1.0: "nm", 1e3: "um", 0.1: "angstrom", 1e9: "m"}
_MOST_CELL_FAULTS = 10_000
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
_NAME_AND_UNIT = re.compile(r"(.*?)[\s_/,.\-]*[\[(]?\s*([^\W\d_]+)\s*[\])]?")


@dataclass(frozen=True)
class Scan:
    """File of curves, read as far as possible.

    Parameters
    ----------
    wavelength_nm : ndarray of shape (n_samples,)
        As in the file, in nm if its unit is known; NaN for anything else.
    names : tuple of str
        Columns.
    values : ndarray of shape (n_samples, n_curves)
        Values; NaN for anything else.
    issues : tuple of tuple of ValidationIssue
        Faults in groups; `read_curves` stops at the first group.
    notes : tuple of str
        Notes on the way it was read.
    """

    wavelength_nm: FloatArray
    names: tuple[str, ...]
    values: FloatArray
    issues: tuple[tuple[ValidationIssue, ...], ...]
    notes: tuple[str, ...] = ()


@dataclass
class TextTable:
    """Table of texts: head, rows with line numbers, and notes.

    `unit` brings its wavelengths to nm (0: unknown), `factor` its values to plain numbers.
    """

    file: str
    line: int
    header: list[str]
    rows: list[tuple[int, list[str]]]
    notes: list[str]
    decimal: str = "."
    unit: float = 1.0
    factor: float = 1.0
    issues: list[ValidationIssue] = field(default_factory=list)


def scan_text(path: Path) -> Scan:
    """Read a table of curves as far as possible; delimiter, decimal mark, head, unit and order are recognized.

    Parameters
    ----------
    path : Path
        File.

    Returns
    -------
    Scan
        Curves; an ambiguous table has issues.

    Raises
    ------
    DataError
        If there is no table.
    """
    table = text_table(path)
    _read_unit_row(table)
    _put_wavelength_first(table)
    _strip_percent(table)
    _find_decimal(table)
    return _numbers(table)


def text_table(path: Path, first: str = WAVELENGTH) -> TextTable:
    """Return head and rows of a file, as texts.

    Parameters
    ----------
    path : Path
        File.
    first : str
        Name of the first column in messages.

    Returns
    -------
    TextTable
        Table.

    Raises
    ------
    DataError
        If there is no table.
    """
    text, notes = _decoded(path)
    table = _laid_out(str(path), text.replace("\0", ""), first, notes)
    if "\0" in text:
        table.issues.append(
            ValidationIssue("NUL characters in the text", str(path), allowed="UTF-8; UTF-16? save as UTF-8")
        )
    _drop_empty_column(table)
    return table


def lens_table(path: Path, first: str) -> TextTable:
    """Return head and rows of a file without wavelengths, with its decimal mark.

    Parameters
    ----------
    path : Path
        File.
    first : str
        Name of the first column in messages.

    Returns
    -------
    TextTable
        Table.
    """
    table = text_table(path, first)
    _find_decimal(table)
    return table


def _decoded(path: Path) -> tuple[str, list[str]]:
    """Return a file's text and how it was decoded. Raises DataError where it is no text."""
    content = read_input(path, MOST_BYTES, DataError)
    wide = content[:2] in _UTF_16 and content[:4] != codecs.BOM_UTF32_LE
    beginning = content[:_BEGINNING_BYTES]
    if content[:2] not in _UTF_16 and b"\0" in beginning and _CONTROLS.search(beginning):
        raise DataError(ValidationIssue("not a text table", str(path), allowed="text; save a spreadsheet as CSV"))
    try:
        return content.decode("utf-16" if wide else "utf-8-sig"), ["the text is UTF-16"] if wide else []
    except UnicodeDecodeError:
        return content.decode("latin-1"), ["the text is not UTF-8, and was read as Latin-1"]


def _laid_out(file: str, text: str, first: str, notes: list[str]) -> TextTable:
    """Return head and rows of a text: the head is above the first numbers, or the first line that names wavelengths."""
    lines = io.StringIO(text, newline=None).read().split("\n")
    kept = [(n, line) for n, line in enumerate(lines, 1) if line.strip() and not line.startswith(_COMMENTS)]
    begin = next((i for i, (_, line) in enumerate(kept) if _BEGIN.fullmatch(line.strip())), None)
    if begin is not None:
        notes.append(f"{kept[begin][0]} lines of a spectrometer's head were left out")
        kept = kept[begin + 1 :]
    if kept and _END.fullmatch(kept[-1][1].strip()):
        kept.pop()
    empty = ValidationIssue("the file is empty", file, allowed=f"a header `{first},...` and rows of numbers")
    if not kept:
        raise DataError(empty)
    mark = _mark([line for _, line in kept[:_RELEVANT]])
    check_size(file, None, len(kept) - 1, kept[0][1].count(mark))
    at = _head(kept, mark) if begin is None else None
    if at:
        notes.append(f"{at} title {'line was' if at == 1 else 'lines were'} left out")
    if _MARKS[mark]:
        notes.append(f"columns are separated by {_MARKS[mark]}")
    rows = _rows(file, kept[at or 0 :], mark)
    if not rows:
        raise DataError(empty)
    line, header = rows[0]
    if at is None:
        columns = len(header)
        header = [WAVELENGTH, *(["values"] if columns == 2 else [f"curve_{i}" for i in range(1, columns)])]
        notes.append("there is no header: the first column was taken for wavelengths")
        return TextTable(file, line, header, rows, notes, unit=0.0)
    check_size(file, line, len(rows) - 1, len(header) - 1)
    return TextTable(file, line, [cell.strip() for cell in header], rows[1:], notes)


def _mark(lines: Sequence[str]) -> str:
    """Return the separator of the columns: the first of tabs, semicolons and commas that most lines have equally often.

    In a text with semicolons or tabs, a comma is a decimal one.
    """
    for mark in ("\t", ";", ","):
        counts = [line.count(mark) for line in lines]
        positive = [count for count in counts if count]
        if 2 * len(positive) > len(lines) and positive.count(max(set(positive), key=positive.count)) * 2 > len(
            positive
        ):
            return mark
    first = next((mark for mark in (",", ";", "\t") if mark in lines[0]), "")
    last = lines[-1].split()
    return first or (" " if len(last) > 1 and all(map(_numeric, last)) else ",")


def _head(kept: Sequence[tuple[int, str]], mark: str) -> int | None:
    """Return the index of the head among the lines; None where the first line has numbers alone, and there is none."""
    split = [line.split() if mark == " " else line.split(mark) for _, line in kept[:_RELEVANT]]
    named = next((i for i, cells in enumerate(split) if any(_wavelength_unit(c) is not None for c in cells)), None)
    if named is not None and len(split[named]) > 1:
        return named
    numbers = next((i for i, cells in enumerate(split) if len(cells) > 1 and all(map(_numeric, cells))), None)
    if numbers == 0 and len(split) > 1:
        return None
    return numbers - 1 if numbers and len(split[numbers - 1]) == len(split[numbers]) else 0


def _numeric(cell: str) -> bool:
    return number_of(cell.strip().strip('"').replace(",", ".")) is not None


def _rows(file: str, kept: Sequence[tuple[int, str]], mark: str) -> list[tuple[int, list[str]]]:
    """Return the cells of each line; quotes may hold a separator, and no line."""
    if mark == " ":
        return [(n, line.split()) for n, line in kept]
    rows = []
    for n, line in kept:
        try:
            (cells,) = csv.reader([line], delimiter=mark, strict=line.count('"') % 2 == 1)
        except (csv.Error, ValueError) as error:
            raise DataError(ValidationIssue(f"not a readable CSV: {error}", file, n)) from None
        if any(cell.strip() for cell in cells):
            rows.append((n, cells))
    return rows


def _wavelength_unit(cell: str) -> float | None:
    """Return the factor that brings a column with this head to nm: 1 for `Wavelength (nm)`; 0 where it has no unit.

    None for a head that is none of wavelengths.
    """
    text = " ".join(cell.replace("\u212b", "\u00e5").split()).casefold()
    if text in _WORDS:
        return 0.0
    match = _NAME_AND_UNIT.fullmatch(text)
    if match is None or match[2] not in _UNITS_NM:
        return None
    return _UNITS_NM[match[2]] if not match[1] or match[1].strip() in _WORDS else None


def _drop_empty_column(table: TextTable) -> None:
    """Drop a last column that is empty in every row, as trailing separators make it."""
    width, lengths = len(table.header), {len(row) for _, row in table.rows}
    unnamed = lengths == {width} and not table.header[-1]
    if (unnamed or lengths == {width + 1}) and not any(row[-1].strip() for _, row in table.rows):
        table.header = table.header[: width - unnamed]
        table.rows = [(n, row[:-1]) for n, row in table.rows]
        table.notes.append("an empty last column was left out")


def _read_unit_row(table: TextTable) -> None:
    """Take a second head for units: `nm`, and for the values `%` or nothing."""
    if not table.rows or _wavelength_unit(table.header[0]) != 0:
        return
    first, *units = [cell.strip().strip("[]()") for cell in table.rows[0][1]]
    if first.casefold() not in _UNITS_NM or len(units) != len(table.header) - 1 or set(units) - {"", "%", "-", "1"}:
        return
    table.header[0] = f"wavelength ({first})"
    table.rows = table.rows[1:]
    percent = set(units) == {"%"}
    table.factor = 0.01 if percent else 1.0
    table.notes.append("a row of units was read" + (", values are in percent" if percent else ""))


def _put_wavelength_first(table: TextTable) -> None:
    """Make the wavelengths the first column, and read their unit."""
    header = table.header
    if table.unit == 0:  # there is no head
        return
    units = [_wavelength_unit(cell) for cell in header]
    at = [i for i, unit in enumerate(units) if unit is not None]
    if len(at) != 1 and units[0] is None:
        allowed = f"`{WAVELENGTH}` as the first column"
        table.issues.append(
            ValidationIssue("no column wavelength", table.file, table.line, header[0], header[0], allowed)
        )
        return
    column = at[0]
    table.unit = units[column] or 0.0
    if header[column] != WAVELENGTH or column:
        table.notes.append(f"wavelengths are column {header[column]!r}")
    if table.unit not in (0.0, 1.0):
        table.notes.append(f"wavelengths in {_UNIT_WORDS[table.unit]} were brought to nm")
    index = [i for i in range(column) if _counts(table, i)]
    if index:
        table.notes.append("a column that counts the rows was left out")
    order = [column, *(i for i in range(len(header)) if i != column and i not in index)]
    width = len(header)
    table.header = [WAVELENGTH, *(header[i] for i in order[1:])]
    if order != list(range(width)):
        table.rows = [(n, [row[i] for i in order] if len(row) == width else row) for n, row in table.rows]


def _counts(table: TextTable, column: int) -> bool:
    """Return whether a column without a name holds the numbers of the rows."""
    cells = [row[column].strip() for _, row in table.rows if len(row) == len(table.header)]
    return not table.header[column] and cells in ([str(i + start) for i in range(len(cells))] for start in (0, 1))


def _strip_percent(table: TextTable) -> None:
    """Strip the percent signs where every value has one."""
    values = [cell for _, row in table.rows for cell in row[1:]]
    if values and all(cell.rstrip().endswith("%") for cell in values):
        table.rows = [(n, [row[0], *(cell.rstrip()[:-1].rstrip() for cell in row[1:])]) for n, row in table.rows]
        table.factor = 0.01
        table.notes.append("values have percent signs, and were divided by 100")


def _find_decimal(table: TextTable) -> None:
    """Find the decimal mark: a comma where there are some and no point, in a text that has other separators."""
    text = "".join(cell for _, row in table.rows for cell in row)
    if "," in text and "." not in text and "separated" in str(table.notes):
        table.decimal = ","
        table.notes.append("numbers have decimal commas")


def _numbers(table: TextTable) -> Scan:
    """Return the numbers of a table, in nm and in rising order."""
    layout = [*table.issues, *_header_issues(table)]
    waves = [number_of(row[0].replace(table.decimal, ".")) for _, row in table.rows if row]
    known = [wave for wave in waves if wave is not None]
    falling = len(known) > 1 and known == sorted(known, reverse=True) and known[0] > known[-1]
    values, cells = table_numbers(table.file, table.header, table.rows, table.decimal, falling=falling)
    if falling:
        values = values[::-1]
        table.notes.append("falling wavelengths were turned round")
    unit = table.unit
    if not unit:
        unit = unit_by_size(values[:, 0])
        table.notes.append(f"wavelengths have no unit, and were taken for {_UNIT_WORDS[unit]} by their size")
    wave = values[:, 0] if unit == 1 else np.round(values[:, 0] * unit, 6)
    curves = values[:, 1:] if table.factor == 1 else values[:, 1:] * table.factor
    names = distinct(table.header[1:])
    if layout or cells:  # what is wrong with the wavelengths beside issues that have a line of their own
        sorted_nm = np.unique(wave[np.isfinite(wave)])
        samples = sample_issues(table.file, sorted_nm, [WAVELENGTH], np.zeros((sorted_nm.size, 1)))
    else:
        samples = sample_issues(table.file, wave, names, curves)
    groups = tuple(tuple(group) for group in (layout, cells, *samples) if group)
    return Scan(wave, names, curves, groups, tuple(table.notes))


def _header_issues(table: TextTable) -> list[ValidationIssue]:
    header, file, line = table.header, table.file, table.line
    if header[0] != WAVELENGTH:
        return []  # has its issue already
    twice = [name for index, name in enumerate(header) if name in header[:index]]
    issues = [ValidationIssue("column occurs twice", file, line, name) for name in twice]
    if "" in header:
        issues.append(ValidationIssue("a column has no name", file, line, value=header))
    if len(header) < 2:
        issues.append(
            ValidationIssue("the file has no curve", file, line, allowed="one column or more beside the wavelength")
        )
    return issues


def table_numbers(
    file: str,
    header: list[str],
    rows: list[tuple[int, list[str]]],
    decimal: str,
    *,
    falling: bool = False,
    noun: str = "wavelength",
) -> tuple[FloatArray, list[ValidationIssue]]:
    """Return the numbers of a table and the issues, row by row.

    Parameters
    ----------
    file : str
        File, for the messages.
    header : list of str
        Columns.
    rows : list of (line, cells)
        Rows.
    decimal : str
        Decimal mark.
    falling : bool
        The first column falls from row to row.
    noun : str
        Content of the first column.

    Returns
    -------
    numbers : ndarray of shape (n_samples, n_columns)
        Numbers; NaN where a cell is none.
    issues : list of ValidationIssue
        Faults.
    """
    values = np.full((len(rows), len(header)), np.nan)
    issues: list[ValidationIssue] = []
    order = "strictly decreasing" if falling else "strictly increasing"
    for index, (line, row) in enumerate(rows):
        if len(issues) >= _MOST_CELL_FAULTS:
            issues.append(ValidationIssue("too many errors; the rest was not read", file, line))
            break
        if len(row) != len(header):
            issues.append(ValidationIssue("wrong number of columns", file, line, None, len(row), str(len(header))))
            continue
        for column, text in enumerate(row):
            cell = text.replace(decimal, ".").strip()
            number = number_of(cell)
            if number is None:
                comma = "; a decimal comma? use a point" if _DECIMAL_COMMA.fullmatch(cell) else ""
                issues.append(
                    ValidationIssue("not a usable number", file, line, header[column], cell, f"finite, >= 0{comma}")
                )
                continue
            if number < 0 and column:
                issues.append(ValidationIssue("negative value", file, line, header[column], cell, "finite, >= 0"))
            if number > LARGEST:
                issues.append(ValidationIssue("value too large", file, line, header[column], cell, f"0 to {LARGEST:g}"))
            values[index, column] = number
        now, before = values[index, 0].item(), values[index - 1, 0].item() if index else math.nan
        if now == before:
            issues.append(ValidationIssue(f"{noun} occurs twice", file, line, header[0], now, order))
        elif (now > before) if falling else (now < before):
            issues.append(ValidationIssue(f"{noun}s are not sorted", file, line, header[0], now, order))
    return values, issues


def check_size(file: str, line: int | None, n_samples: int, n_curves: int) -> None:
    """Refuse a table that would take minutes to read.

    Parameters
    ----------
    file : str
        File, for the message.
    line : int or None
        Line.
    n_samples, n_curves : int
        Size.

    Raises
    ------
    DataError
        If it is too large.
    """
    for what, count, most in (
        ("curves", n_curves, MOST_CURVES),
        ("samples", n_samples, MOST_SAMPLES),
        ("values", n_samples * n_curves, MOST_VALUES),
    ):
        if count > most:
            raise DataError(
                ValidationIssue(f"too many {what} in one file", file, line, None, count, f"at most {most:,}")
            )
