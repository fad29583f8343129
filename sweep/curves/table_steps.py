"""From a table of texts as somebody wrote it to one of wavelengths and curves, each step told."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from ..base.errors import Fault
from .wavelength_names import WAVELENGTH, is_unit, unit_words, wavelength_unit

TextRow = tuple[int, list[str]]
"""A line of the file and its cells."""
_FIRST = f"`{WAVELENGTH}` as the first column"


@dataclass(frozen=True)
class TextTable:
    """A table of texts: its head, its rows with their lines, what separates its columns, and how it was read.

    `unit` brings its wavelengths to nm (0: its head says none), `factor` its values to plain numbers.
    """

    file: str
    line: int
    header: list[str]
    rows: list[TextRow]
    mark: str
    decimal: str = "."
    unit: float = 1.0
    factor: float = 1.0
    notes: tuple[str, ...] = ()
    faults: tuple[Fault, ...] = field(default=())

    def noted(self, note: str) -> tuple[str, ...]:
        """Its notes and one more."""
        return (*self.notes, note)


def plainly(table: TextTable) -> TextTable:
    """The table with wavelengths first, without empty columns, percent signs and second heads."""
    for step in (_without_empty_column, _without_unit_row, _wavelength_first, _in_percent, _with_decimal):
        table = step(table)
    return table


def evenly(table: TextTable) -> TextTable:
    """The table without an empty last column, and with the mark of its decimals, whatever its columns are."""
    return _with_decimal(_without_empty_column(table))


def _without_empty_column(table: TextTable) -> TextTable:
    """Without a last column that is empty in every row, as trailing separators make it."""
    width = len(table.header)
    last = {row[-1].strip() for _, row in table.rows if len(row) in (width, width + 1)}
    longer = all(len(row) == width + 1 for _, row in table.rows)
    if (
        last != {""}
        or not (longer or not table.header[-1])
        or not (longer or all(len(r) == width for _, r in table.rows))
    ):
        return table
    header = table.header if longer else table.header[:-1]
    rows = [(n, row[: len(header)]) for n, row in table.rows]
    return replace(table, header=header, rows=rows, notes=table.noted("an empty last column was left out"))


def _without_unit_row(table: TextTable) -> TextTable:
    """Without a second head that has units: `nm`, and for the values `%` or nothing."""
    if not table.rows or not is_unit(table.rows[0][1][0]) or wavelength_unit(table.header[0]) != 0:
        return table
    units = [cell.strip().strip("[]()") for cell in table.rows[0][1]]
    if len(units) != len(table.header) or any(unit not in ("", "%", "-", "1") for unit in units[1:]):
        return table
    header = [f"wavelength ({units[0]})", *table.header[1:]]
    factor = 0.01 if set(units[1:]) == {"%"} else 1.0
    note = "a row of units was read" + (", values are in percent" if factor != 1 else "")
    return replace(table, header=header, rows=table.rows[1:], factor=factor, notes=table.noted(note))


def _wavelength_first(table: TextTable) -> TextTable:
    """With the wavelengths as the first column, and their unit."""
    if table.unit == 0:  # there is no head
        return table
    units = [wavelength_unit(cell) for cell in table.header]
    at = [i for i, unit in enumerate(units) if unit is not None]
    if len(at) != 1 and units[0] is None:
        first = table.header[0]
        fault = Fault(
            "no column wavelength", table.file, table.line, first, first, f"`{WAVELENGTH}` as the first column"
        )
        return replace(table, faults=(*table.faults, fault))
    place = at[0]
    unit = units[place] or 0.0
    notes = list(table.notes)
    if table.header[place] != WAVELENGTH or place:
        notes.append(f"wavelengths are column {table.header[place]!r}")
    if unit not in (0.0, 1.0):
        notes.append(f"wavelengths in {unit_words(unit)} were brought to nm")
    index = [i for i in range(place) if _counts(table, i)]
    if index:
        notes.append("a column that counts the rows was left out")
    order = [place, *(i for i in range(len(table.header)) if i != place and i not in index)]
    header = [WAVELENGTH, *(table.header[i] for i in order[1:])]
    width = len(table.header)
    rows = table.rows
    if order != list(range(width)):
        rows = [(n, [row[i] for i in order] if len(row) == width else row) for n, row in rows]
    return replace(table, header=header, rows=rows, unit=unit, notes=tuple(notes))


def _counts(table: TextTable, column: int) -> bool:
    """Whether a column without a name holds the numbers of the rows."""
    cells = [row[column].strip() for _, row in table.rows if len(row) == len(table.header)]
    return not table.header[column] and cells in ([str(i + start) for i in range(len(cells))] for start in (0, 1))


def _in_percent(table: TextTable) -> TextTable:
    """With plain numbers, where every value has its percent sign."""
    values = [cell for _, row in table.rows for cell in row[1:]]
    if not values or not all(cell.rstrip().endswith("%") for cell in values):
        return table
    rows = [(n, [row[0], *(cell.rstrip().removesuffix("%").rstrip() for cell in row[1:])]) for n, row in table.rows]
    return replace(
        table, rows=rows, factor=0.01, notes=table.noted("values have percent signs, and were divided by 100")
    )


def _with_decimal(table: TextTable) -> TextTable:
    """With the mark of its decimals: a comma where there are some and no point, in a text that has other separators."""
    cells = [cell for _, row in table.rows for cell in row]
    if (
        any("," in cell for cell in cells)
        and not any("." in cell for cell in cells)
        and "separated" in str(table.notes)
    ):
        return replace(table, decimal=",", notes=table.noted("numbers have decimal commas"))
    return table
