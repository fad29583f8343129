"""What stands above the numbers of a table: names and units of its columns, titles, and which ones are wavelengths."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise

import numpy as np

from ..base.errors import ValidationIssue
from .layouts import UNITS_NM, WAVELENGTH, refuse_other_axis, rising, wave_unit, wave_unit_of_word
from .read_text import Rows, Sheet
from .spectrum import Unit
from .units import begun_by_quantity, folded, stated_in_title, symbol_unit, unit_of

Series = Sequence[float | None]
_X = re.compile(r"(.*?[\s_\-.])?x(_?\d+)?|")


@dataclass
class Table:
    """A table under work: rows of numbers, and of the texts above them."""

    sheet: Sheet
    head: Rows
    body: Rows
    parsed: list[list[float | None]]
    width: int
    factor_nm: float = 0.0
    between: Rows = field(default_factory=list)
    issues: list[ValidationIssue] = field(default_factory=list)

    @cached_property
    def series(self) -> list[list[float | None]]:
        """Numbers of each column; NaN for missing ones, None for texts."""
        return [[row[at] if at < len(row) else np.nan for row in self.parsed] for at in range(self.width)]

    def fault(self, problem: str, line: int | None, key: str | None, value: object, allowed: str | None = None) -> None:
        """Add an issue."""
        self.issues.append(ValidationIssue(problem, self.sheet.file, line, key, value, allowed))


@dataclass
class Heads:
    """What stands above numbers: names and units of the columns (empty for none), their line, and titles."""

    line: int | None
    names: list[str]
    units: list[str]
    titles: Rows


def heads_of(table: Table) -> Heads:
    """Take units and names from the rows above numbers."""
    units, head = [""] * table.width, list(table.head)
    if head and len(head[-1][1]) <= table.width and _is_unit_row(head):
        cells = head.pop()[1]
        units[: len(cells)] = map(_bare, cells)
        table.sheet.notes.append("a row of units was read")
    line, names = _names(table, head)
    if names and not names[-1] and names[0] and table.width > 1 and steps_by_one(table.series[0]):
        names = ["", *names[:-1]]  # as R writes row names
    return Heads(line, names, units, head)


def wave_columns(table: Table, heads: Heads) -> list[int]:
    """Return the columns of wavelengths, and keep the factor that brings them to nm."""
    names, units, notes = heads.names, heads.units, table.sheet.notes
    waves = [wave_unit(cell) if cell else None for cell in names or units]
    for at, wave in enumerate(waves):
        if names and wave is not None and units[at] and folded(units[at]) not in UNITS_NM:
            table.fault("wavelengths in an unknown unit", heads.line, names[at], units[at], ", ".join(UNITS_NM))
        if wave in (0, None) and (wave == 0 or not any(known is not None for known in waves)):
            waves[at] = UNITS_NM.get(folded(units[at]), wave)
    found = [at for at, wave in enumerate(waves) if wave is not None] or _unnamed_waves(table, names)
    if not found:
        refuse_other_axis(table.sheet.file, heads.line, names[0] if names else "")
        first = names[0] if names else ""
        table.fault("no column wavelength", heads.line, first, first, f"`{WAVELENGTH}` as the first column")
        found = [0]
    table.factor_nm = waves[found[0]] or 0.0
    if len({waves[at] or 0.0 for at in found}) > 1:
        table.fault("wavelengths in two units", heads.line, None, [names[at] for at in found])
    if names and (names[found[0]] != WAVELENGTH or found[0]) and waves[found[0]] is not None:
        notes.append(f"wavelengths are column {names[found[0]]!r}")
    if len(found) > 1:
        notes.append(f"each curve has wavelengths of its own: {len(found)} pairs of columns")
    return found


def _bare(cell: str) -> str:
    """Return a cell without brackets around all of it."""
    return cell[1:-1].strip() if cell[:1] in ("[", "(") and cell[-1:] in ("]", ")") else cell


def _is_unit_row(head: Rows) -> bool:
    """Return whether the last of the rows above numbers holds units alone, below a row of names."""
    given = [_bare(cell) for cell in head[-1][1] if _bare(cell)]
    if len(head) < 2 or not given:
        return False
    pure = [folded(cell) in UNITS_NM or symbol_unit(cell) is not None for cell in given]
    named = len(head[-2][1]) > 1 and any(wave_unit(cell) is not None for cell in head[-2][1])
    of_wave = any(folded(cell) in UNITS_NM for cell in given)
    worded = any(map(wave_unit_of_word, head[-1][1]))
    told = all(known or unit_of(cell).words for known, cell in zip(pure, given, strict=True))
    return (all(pure) and of_wave) or (told and named and not worded)


def _names(table: Table, head: Rows) -> tuple[int | None, list[str]]:
    """Take the row of names from the rows above the numbers; the others are titles."""
    sheet = table.sheet
    named = next((at for at in reversed(range(len(head))) if any(map(wave_unit_of_word, head[at][1]))), None)
    if named is None and head:
        last = head[-1][1]
        if 1 < len(last) <= table.width or any(wave_unit(cell) is not None for cell in last):
            named = len(head) - 1
    if named is None:
        if head and len(head[-1][1]) == 1 < len(re.split(r"[;,\t|]", head[-1][1][0])) == table.width:
            table.fault("heads have another separator than numbers", head[-1][0], None, head[-1][1][0], "one separator")
        if head:
            sheet.notes.append(_titles(len(head)))
        sheet.notes.append("there is no header: the first column was taken for wavelengths")
        return None, []
    line, names = head[named]
    if len(names) > table.width or (len(names) == 1 < table.width and len(head) == 1):
        table.fault("wrong number of columns", table.body[0][0], None, table.width, str(len(names)))
    table.between = head[named + 1 :]
    del head[named:]
    if head and not (len(head[-1][1]) > 1 and sum(wave_unit(cell) is not None for cell in names) > 1):
        sheet.notes.append(_titles(len(head)))
    return line, [*names, *[""] * (table.width - len(names))][: table.width]


def _titles(count: int) -> str:
    return f"{count} title {'line was' if count == 1 else 'lines were'} left out"


def _unnamed_waves(table: Table, names: Sequence[str]) -> list[int]:
    """Return the columns of wavelengths that no word tells: every second one, or the first."""

    def like(at: int) -> bool:
        values = [value for value in table.series[at] if value is None or not np.isnan(value)]
        return len(values) > 1 and all(value is not None for value in values)

    def rises(at: int) -> bool:
        return like(at) and rising([value for value in table.series[at] if value is None or not np.isnan(value)])

    even = range(0, table.width, 2)
    if table.width % 2 == 0 and table.width > 2:
        if (
            names
            and all(_X.fullmatch(folded(names[at])) for at in even)
            and all(names[at] for at in even)
            and all(map(like, even))
        ):
            return [*even]
        if all(map(rises, even)) and not all(map(rises, range(1, table.width, 2))):
            return [*even]
    if not names and table.width > 2 and counting(table.series[0]) and rises(1):
        return [1]
    return [0] if (not names or _X.fullmatch(folded(names[0]))) else []


def counting(values: Series) -> bool:
    """Return whether numbers are those of the rows, from 0 or 1 on."""
    known = list(values)
    return len(known) > 1 and any(known == [float(at + start) for at in range(len(known))] for start in (0, 1))


def steps_by_one(values: Series) -> bool:
    """Return whether whole numbers rise by one from row to row, as row names of a part of a table do."""
    known = [value for value in values if value is not None]
    return len(known) == len(values) > 2 and all(b - a == 1 and a == int(a) for a, b in pairwise(known))


def table_units(table: Table, head: Rows) -> tuple[Unit, Unit]:
    """Return the unit that the format, a title or a comment states for all columns, and one of words of a title."""
    if (stated := table.sheet.unit.strip()) == "A":
        return Unit(stated, "density"), Unit()
    if stated:
        unit = symbol_unit(stated) or unit_of(stated)
        return (unit if unit.words else Unit(stated, unclear="has an unknown unit")), Unit()
    texts = [*table.sheet.remarks, *(" ".join(cells) for _, cells in head if cells[0])]
    return _only([stated_in_title(text) for text in texts]), _only([begun_by_quantity(text) for text in texts])


def _only(units: Sequence[Unit | None]) -> Unit:
    """Return the only unit of several texts; one that is unclear if they contradict each other."""
    found = [unit for unit in units if unit is not None]
    if len({(unit.quantity, unit.factor, unit.unclear) for unit in found}) > 1:
        return Unit("; ".join(unit.words for unit in found), unclear="contradicts itself")
    return found[0] if found else Unit()
