"""Tables of text as instruments and spreadsheets write them: what can be meant in one way only is read, and told."""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..base.disk import read_input
from ..base.errors import DataError, Fault
from ..base.types import FloatArray
from .cells import TableCells, number_of
from .scan import MOST_BYTES, Scan, check_size, distinct
from .spectrum import sample_faults
from .table_steps import TextRow, TextTable, plainly
from .wavelength_names import WAVELENGTH, unit_words, wavelength_unit

_COMMENTS = ("#", "%", "//")
_BEGIN = re.compile(r">{3,}begin.*<{3,}|\[data\]", re.IGNORECASE)
_END = re.compile(r">{3,}end.*<{3,}|\[endoffile\]|\[end.*\]", re.IGNORECASE)
"""Of spectrometers: `>>>>>Begin Spectral Data<<<<<` (Ocean), `[Data]` (Thorlabs)."""
_MARKS = {"\t": "tabs", ";": "semicolons", ",": "", " ": "blanks"}
_RELEVANT = 50
"""Lines that say how a table is laid out."""
_UTF_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
_BEGINNINGS = {
    b"PK\x03\x04": "a ZIP archive or a spreadsheet (.xlsx)",
    b"\xd0\xcf\x11\xe0": "an old spreadsheet (.xls)",
    b"\x1f\x8b": "a gzip archive",
    b"\x89PNG": "a PNG picture",
    b"\xff\xd8\xff": "a JPEG picture",
    b"%PDF-": "a PDF document",
    b"\x7fELF": "a program",
}
"""Files that are no text, by their first bytes."""
_CONTROLS = re.compile(rb"[\x01-\x08\x0e-\x19\x1c-\x1f]")
"""Control bytes that no text has, UTF-16 and stray NULs included."""
_BEGINNING_BYTES = 4096


def scan_text(path: Path) -> Scan:
    """Read a table of text as far as possible; its delimiter, decimal mark, head, unit and order are found out.

    What is not as `wavelength_nm,...` with points is in `notes`. What two readers could read in two ways is a fault.
    Raises DataError where there is no table at all.
    """
    return _numbers(plainly(text_table(path)))


def text_table(path: Path, first: str = WAVELENGTH) -> TextTable:
    """Head and rows of a file, as texts; `first`: what its first column is to be called.

    Raises DataError where there is no table at all.
    """
    text, notes, faults = _decoded(path)
    table = _laid_out(str(path), text, first)
    return replace(table, notes=(*notes, *table.notes), faults=(*faults, *table.faults))


def _decoded(path: Path) -> tuple[str, list[str], list[Fault]]:
    """A file's text; how it was decoded, and the fault of one with NULs. Raises DataError where it is no text."""
    content = read_input(path, MOST_BYTES, DataError)
    kind = _kind_of(content[:_BEGINNING_BYTES])
    if kind is not None:
        raise DataError(Fault(f"not a text table: {kind}", str(path), allowed="text; save it as CSV"))
    notes: list[str] = []
    try:
        if content[:2] in _UTF_16 and content[:4] != codecs.BOM_UTF32_LE:
            text = content.decode("utf-16")
            notes.append("the text is UTF-16")
        else:
            text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("latin-1")
        notes.append("the text is not UTF-8, and was read as Latin-1")
    if "\0" in text:
        fault = Fault("NUL characters in the text", str(path), allowed="UTF-8; UTF-16? save as UTF-8")
        return text.replace("\0", ""), notes, [fault]
    return text, notes, []


def _kind_of(beginning: bytes) -> str | None:
    """Name what a file is that is no text; it would take long to find a fault in each of its lines."""
    known = next((kind for first, kind in _BEGINNINGS.items() if beginning.startswith(first)), None)
    binary = beginning[:2] not in _UTF_16 and b"\0" in beginning and _CONTROLS.search(beginning)
    return known or ("binary data" if binary else None)


def _laid_out(file: str, text: str, first: str) -> TextTable:
    """Head and rows of a text: the head is the line above the first numbers, or the first that names wavelengths."""
    lines = io.StringIO(text, newline=None).read().split("\n")
    kept = [(n, line) for n, line in enumerate(lines, 1) if line.strip() and not line.startswith(_COMMENTS)]
    begin = next((i for i, (_, line) in enumerate(kept) if _BEGIN.fullmatch(line.strip())), None)
    notes = [] if begin is None else [f"{kept[begin][0]} lines of a spectrometer's head were left out"]
    kept = kept if begin is None else kept[begin + 1 :]
    if kept and _END.fullmatch(kept[-1][1].strip()):
        kept = kept[:-1]
    if not kept:
        raise DataError(Fault("the file is empty", file, allowed=f"a header `{first},...` and rows of numbers"))
    mark = _mark([line for _, line in kept[:_RELEVANT]])
    count = kept[0][1].count(mark) if mark else 0
    check_size(file, None, len(kept) - 1, count)
    at = _head(kept, mark) if begin is None else None
    if at:
        notes.append(f"{at} title {'line was' if at == 1 else 'lines were'} left out")
    if mark and _MARKS[mark]:
        notes.append(f"columns are separated by {_MARKS[mark]}")
    rows = _rows(file, kept[at or 0 :], mark)
    if not rows:
        raise DataError(Fault("the file is empty", file, allowed=f"a header `{first},...` and rows of numbers"))
    line, header = rows[0]
    if at is None:
        columns = len(header)
        header = [WAVELENGTH, *(["values"] if columns == 2 else [f"curve_{i}" for i in range(1, columns)])]
        notes.append("there is no header: the first column was taken for wavelengths")
        return TextTable(file, line, header, rows, mark, unit=0.0, notes=tuple(notes))
    check_size(file, line, len(rows) - 1, len(header) - 1)
    return TextTable(file, line, [cell.strip() for cell in header], rows[1:], mark, notes=tuple(notes))


def _mark(lines: Sequence[str]) -> str:
    """What separates the columns: the first of tabs, semicolons, commas and blanks that most lines have equally often.

    In a text with semicolons or tabs, a comma is a decimal one.
    """
    for mark in ("\t", ";", ","):
        counts = [line.count(mark) for line in lines]
        some = [count for count in counts if count]
        if 2 * len(some) > len(lines) and some.count(max(set(some), key=some.count)) * 2 > len(some):
            return mark
    first = next((mark for mark in (",", ";", "\t") if mark in lines[0]), "")
    split = [line.split() for line in lines]
    if not first and all(len(cells) > 1 for cells in split[-1:]) and all(_numeric(c) for c in split[-1]):
        return " "
    return first or ","


def _head(kept: Sequence[tuple[int, str]], mark: str) -> int | None:
    """Which of the lines is the head; None where the first line has numbers alone, and there is none."""
    split = [_cells(line, mark) for _, line in kept[:_RELEVANT]]
    named = next((i for i, cells in enumerate(split) if any(wavelength_unit(c) is not None for c in cells)), None)
    if named is not None and len(split[named]) > 1:
        return named
    if len(split[0]) > 1 and all(_numeric(cell) for cell in split[0]) and len(split) > 1:
        return None
    numbers = next((i for i, cells in enumerate(split) if len(cells) > 1 and all(map(_numeric, cells))), 0)
    return max(0, numbers - 1) if numbers and len(split[numbers - 1]) == len(split[numbers]) else 0


def _cells(line: str, mark: str) -> list[str]:
    return line.split() if mark == " " else line.split(mark)


def _numeric(cell: str) -> bool:
    return number_of(cell.strip().strip('"').replace(",", ".")) is not None


def _rows(file: str, kept: Sequence[tuple[int, str]], mark: str) -> list[TextRow]:
    """The cells of each line; quotes may hold a separator, and no line."""
    if mark == " ":
        return [(n, line.split()) for n, line in kept]
    found = []
    for n, line in kept:
        try:
            (cells,) = csv.reader([line], delimiter=mark, strict=line.count('"') % 2 == 1)
        except (csv.Error, ValueError) as error:
            raise DataError(Fault(f"not a readable CSV: {error}", file, n)) from None
        if any(cell.strip() for cell in cells):
            found.append((n, cells))
    return found


def _numbers(table: TextTable) -> Scan:
    """The numbers of a table, in nm and in rising order."""
    layout = [*table.faults, *_header_faults(table)]
    waves = [number_of(row[0].replace(table.decimal, ".")) for _, row in table.rows if row]
    known = [wave for wave in waves if wave is not None]
    falling = len(known) > 1 and known == sorted(known, reverse=True) and known[0] > known[-1]
    values, cells = TableCells(table.file, table.header, table.decimal, falling).read(table.rows)
    notes = list(table.notes)
    if falling:
        values = values[::-1]
        notes.append("falling wavelengths were turned round")
    unit = table.unit or _unit_by_size(values[:, 0], notes)
    wave = values[:, 0] if unit == 1 else np.round(values[:, 0] * unit, 6)
    curves = values[:, 1:] if table.factor == 1 else values[:, 1:] * table.factor
    names = distinct(table.header[1:])
    clean = not layout and not cells
    samples = sample_faults(table.file, wave, names, curves) if clean else _unit_faults(table.file, wave)
    return Scan(wave, names, curves, tuple(tuple(group) for group in (layout, cells, *samples) if group), tuple(notes))


def _unit_by_size(wave: FloatArray, notes: list[str]) -> float:
    """The unit of wavelengths whose head says none: by their size, light between 100 nm and 20 um."""
    largest = float(np.nanmax(wave)) if np.isfinite(wave).any() else 0.0
    unit = 1e9 if 0 < largest < 1e-4 else 1e3 if 0 < largest < 20 else 1.0
    notes.append(f"wavelengths have no unit, and were taken for {unit_words(unit)} by their size")
    return unit


def _header_faults(table: TextTable) -> list[Fault]:
    header, file, line = table.header, table.file, table.line
    if header[0] != WAVELENGTH:
        return []  # told already
    seen: set[str] = set()
    twice = [name for name in header if name in seen or seen.add(name)]  # type: ignore[func-returns-value]
    faults = [Fault("column occurs twice", file, line, name) for name in twice]
    if "" in header:
        faults.append(Fault("a column has no name", file, line, value=header))
    if len(header) < 2:
        faults.append(Fault("the file has no curve", file, line, allowed="one column or more beside the wavelength"))
    return faults


def _unit_faults(file: str, wave: FloatArray) -> list[list[Fault]]:
    """What is wrong with the wavelengths beside faults that have a line of their own."""
    sorted_nm = np.unique(wave[np.isfinite(wave)])
    return sample_faults(file, sorted_nm, [WAVELENGTH], np.zeros((sorted_nm.size, 1)))
