"""A lens's chief ray angle over image height, as data sheets have it: a table of two columns."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..base.errors import DataError, Fault
from ..base.types import FloatArray
from .cells import TableCells
from .table_steps import TextTable, evenly
from .text_tables import text_table

_FIRST = "height_mm"
_ALLOWED = "`height_mm`, `height_percent` or `height_relative`, and `cra_deg`"
_UNITS = {
    "mm": re.compile(r"\bmm\b|millimet"),
    "percent": re.compile(r"%|\bpercent"),
    "relative": re.compile(r"\brel|\bnorm"),
}
_CRA = re.compile(r"\bcra\b|\bchief")
_ANGLE = re.compile(r"\bcra\b|\bchief|\bdeg|°|\bangle|\brad\b|radian")
"""What a lone column is called."""
_STEEPEST_DEG = 60.0
_MOST_ROWS = 1000


@dataclass(frozen=True)
class ChiefRays:
    """Chief ray angles, degrees, at rising image heights relative to the corner, 0 to 1; and how the file was read."""

    heights: FloatArray
    cra_deg: FloatArray
    notes: tuple[str, ...] = ()


def read_chief_rays(path: Path, corner_mm: float | None = None) -> ChiefRays:
    """Read a table of image height and chief ray angle, from the middle of the sensor to its corner or beyond.

    Heights are in mm, percent or relative, as the head of their column says; the corner is the last row, or at
    `corner_mm`. Raises DataError (file, line, column, value) on anything that is not clean.
    """
    table = evenly(text_table(path, _FIRST))
    if table.faults:
        raise DataError(table.faults[0])
    unit, column = _columns(table)
    names = [_FIRST.replace("mm", unit), table.header[column]]
    odd = next(((line, row) for line, row in table.rows if len(row) != len(table.header)), None)
    if odd is not None:
        raise DataError(Fault("wrong number of columns", table.file, odd[0], None, len(odd[1]), str(len(table.header))))
    rows = [(line, [row[0], row[column]]) for line, row in table.rows]
    if len(rows) > _MOST_ROWS:
        raise DataError(Fault("too many rows", table.file, rows[-1][0], None, len(rows), f"at most {_MOST_ROWS}"))
    values, faults = TableCells(table.file, names, table.decimal, first=names[0], noun="image height").read(rows)
    if faults:
        raise DataError(faults[0])
    return _to_corner(table, unit, values, names, corner_mm)


def _plain(cell: str) -> str:
    """A head in words: `Image_Height(mm)` as `image height(mm)`."""
    return re.sub(r"[\s_.,/]+", " ", cell).casefold().strip()


def _columns(table: TextTable) -> tuple[str, int]:
    """The unit of the heights, and which column has the angles."""
    file, line, header = table.file, table.line, table.header
    if table.unit == 0:
        raise DataError(Fault("there is no header", file, line, None, None, _ALLOWED))
    plain = [_plain(cell) for cell in header]
    units = [unit for unit, pattern in _UNITS.items() if pattern.search(plain[0])]
    if len(units) != 1:
        raise DataError(
            Fault("the first column does not say the unit of image heights", file, line, header[0], None, _ALLOWED)
        )
    angles = [at for at in range(1, len(header)) if _CRA.search(plain[at])]
    if len(header) == 2 and _ANGLE.search(plain[1]):
        angles = [1]
    if len(angles) != 1:
        raise DataError(Fault("which column has chief ray angles?", file, line, None, ", ".join(header), _ALLOWED))
    if re.search(r"\brad\b|radian", plain[angles[0]]):
        raise DataError(Fault("chief ray angles are in radians", file, line, header[angles[0]], None, "degrees"))
    return units[0], angles[0]


def _to_corner(table: TextTable, unit: str, values: FloatArray, names: list[str], corner_mm: float | None) -> ChiefRays:
    """From the middle of the sensor to its corner."""
    (heights, cra_deg), file, notes = values.T, table.file, list(table.notes)
    last_line = table.rows[-1][0]
    if heights.size < 2:
        raise DataError(Fault("a lens needs two rows or more", file, last_line, None, heights.size))
    if heights[0] != 0:
        line = table.rows[0][0]
        raise DataError(
            Fault("image heights begin in the middle of the sensor", file, line, names[0], heights[0].item(), "0")
        )
    steep = np.flatnonzero(cra_deg > _STEEPEST_DEG)
    if steep.size:
        line, value = table.rows[int(steep[0])][0], float(cra_deg[steep[0]])
        raise DataError(Fault("too steep a chief ray", file, line, names[1], value, f"0 to {_STEEPEST_DEG:g} degrees"))
    whole = {"percent": 100.0, "relative": 1.0}.get(unit)
    if whole is not None and corner_mm is not None:
        raise DataError(Fault(f"`corner_mm` needs heights in mm, not {unit}", file, table.line, names[0]))
    if whole is not None and heights[-1] != whole:
        raise DataError(
            Fault("the last row is not the corner", file, last_line, names[0], heights[-1].item(), f"{whole:g}")
        )
    corner = float(heights[-1]) if corner_mm is None else corner_mm
    if corner > heights[-1]:
        raise DataError(
            Fault("the table ends before the corner", file, last_line, names[0], heights[-1].item(), f"{corner:g} mm")
        )
    if unit == "mm" and corner_mm is None:
        notes.append(f"the last row, {corner:g} mm, was taken for the corner of the sensor")
    inside = heights < corner
    kept = np.append(heights[inside] / corner, 1.0)
    return ChiefRays(kept, np.append(cra_deg[inside], np.interp(corner, heights, cra_deg)), tuple(notes))
