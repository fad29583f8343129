"""Chief ray angle over image height of a lens, as a table of two columns."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..base.errors import DataError, ValidationIssue
from ..base.types import Array, Float
from .read_text import Sheet, number_of, text_sheet

_FIRST = "height_mm"
_ALLOWED = "`height_mm`, `height_percent` or `height_relative`, and `cra_deg`"
_UNITS = {
    "mm": re.compile(r"\bmm\b|millimet"),
    "percent": re.compile(r"%|\bpercent"),
    "relative": re.compile(r"\brel|\bnorm"),
}
_CRA = re.compile(r"\bcra\b|\bchief")
_ANGLE = re.compile(r"\bcra\b|\bchief|\bdeg|°|\bangle|\brad\b|radian")
"""Heads of the only column beside the heights."""
_STEEPEST_DEG = 60.0
_MOST_ROWS = 1000


@dataclass(frozen=True)
class ChiefRays:
    """Chief ray angles, degrees, at rising image heights relative to the corner, and notes on the file."""

    heights: Float[Array, " heights"]
    cra_deg: Float[Array, " heights"]
    notes: tuple[str, ...] = ()


def read_chief_rays(path: Path, corner_mm: float | None = None) -> ChiefRays:
    """Read a table of image height and chief ray angle, from the center of the sensor to its corner or beyond.

    `corner_mm`: image height of the corner, mm; left out, the last row. Heights are in mm, percent or relative, by the
    head of their column. Raises DataError if the file cannot be read or is not clean, with file, line, column and
    value.
    """
    table = text_sheet(path, f"a header `{_FIRST},...` and rows of numbers")
    unit, column = _columns(table)
    names = [_FIRST.replace("mm", unit), table.rows[0][1][column]]
    if len(table.rows) - 1 > _MOST_ROWS:
        raise DataError(
            ValidationIssue("too many rows", table.file, None, None, len(table.rows) - 1, f"at most {_MOST_ROWS}")
        )
    return _to_corner(table, unit, _numbers(table, names, column), names, corner_mm)


def _numbers(table: Sheet, names: list[str], column: int) -> Float[Array, "rows 2"]:
    """Return heights and angles. Raises DataError for other cells, and for heights that do not rise."""
    values: list[list[float]] = []
    for line, row in table.rows[1:]:
        if len(row) != len(table.rows[0][1]):
            problem = "wrong number of columns"
            raise DataError(ValidationIssue(problem, table.file, line, None, len(row), str(len(table.rows[0][1]))))
        numbers = []
        for name, cell in zip(names, (row[0], row[column]), strict=True):
            number = number_of(cell.replace(table.decimal, "."))
            if number is None or number < 0:
                problem = "not a usable number" if number is None else "negative value"
                raise DataError(ValidationIssue(problem, table.file, line, name, cell, "finite, >= 0"))
            numbers.append(number)
        if values and numbers[0] <= values[-1][0]:
            problem = "image height occurs twice" if numbers[0] == values[-1][0] else "image heights are not sorted"
            raise DataError(ValidationIssue(problem, table.file, line, names[0], numbers[0], "strictly increasing"))
        values.append(numbers)
    return np.array(values).reshape(-1, 2)


def _columns(table: Sheet) -> tuple[str, int]:
    """Return the unit of the heights, and the index of the column of angles."""
    file, (line, header) = table.file, table.rows[0]
    if all(number_of(cell.replace(table.decimal, ".")) is not None for cell in header):
        raise DataError(ValidationIssue("there is no header", file, line, None, None, _ALLOWED))
    plain = [re.sub(r"[\s_.,/]+", " ", cell).casefold().strip() for cell in header]
    units = [unit for unit, pattern in _UNITS.items() if pattern.search(plain[0])]
    if len(units) != 1:
        problem = "the first column does not say the unit of image heights"
        raise DataError(ValidationIssue(problem, file, line, header[0], None, _ALLOWED))
    pattern = _ANGLE if len(header) == 2 else _CRA
    angles = [at for at in range(1, len(header)) if pattern.search(plain[at])]
    if len(angles) != 1:
        raise DataError(
            ValidationIssue("which column has chief ray angles?", file, line, None, ", ".join(header), _ALLOWED)
        )
    if re.search(r"\brad\b|radian", plain[angles[0]]):
        raise DataError(
            ValidationIssue("chief ray angles are in radians", file, line, header[angles[0]], None, "degrees")
        )
    return units[0], angles[0]


def _to_corner(
    table: Sheet, unit: str, values: Float[Array, "heights 2"], names: list[str], corner_mm: float | None
) -> ChiefRays:
    """Return the rays from the center of the sensor to its corner."""

    def check(passes: bool | np.bool, problem: str, row: int, column: int, allowed: str | None = None) -> None:
        if not passes:
            line, value = table.rows[1:][row][0], values[row, column].item()
            raise DataError(ValidationIssue(problem, table.file, line, names[column], value, allowed))

    heights, cra_deg = values.T
    if heights.size < 2:
        raise DataError(
            ValidationIssue("a lens needs two rows or more", table.file, table.rows[-1][0], None, heights.size)
        )
    steep = int(np.argmax(cra_deg > _STEEPEST_DEG))
    full_height = {"percent": 100.0, "relative": 1.0}.get(unit)
    if full_height is not None and corner_mm is not None:
        raise DataError(
            ValidationIssue(f"`corner_mm` needs heights in mm, not {unit}", table.file, table.rows[0][0], names[0])
        )
    corner = float(heights[-1]) if corner_mm is None else corner_mm
    check(heights[0] == 0, "image heights begin in the middle of the sensor", 0, 0, "0")
    check(cra_deg[steep] <= _STEEPEST_DEG, "too steep a chief ray", steep, 1, f"0 to {_STEEPEST_DEG:g} degrees")
    check(
        full_height is None or heights[-1] == full_height,
        "the last row is not the corner",
        -1,
        0,
        f"{full_height or 0:g}",
    )
    check(corner <= heights[-1], "the table ends before the corner", -1, 0, f"{corner:g} mm")
    notes = list(table.notes)
    if unit == "mm" and corner_mm is None:
        notes.append(f"the last row, {corner:g} mm, was taken for the corner of the sensor")
    inside = heights < corner
    relative_heights = np.append(heights[inside] / corner, 1.0)
    return ChiefRays(relative_heights, np.append(cra_deg[inside], np.interp(corner, heights, cra_deg)), tuple(notes))
