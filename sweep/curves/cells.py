"""The numbers of a table of text, and what is wrong with which cell."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field

import numpy as np

from ..base.errors import Fault
from ..base.types import FloatArray
from .spectrum import LARGEST
from .wavelength_names import WAVELENGTH

_MOST_CELL_FAULTS = 10_000
_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")
_ODD = re.compile(r"[^0-9eE+\-. \t]")
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")


@dataclass
class TableCells:
    """The numbers of a table, and the faults of its cells and rows, up to a limit.

    `decimal`: the mark in its numbers; `falling`: its wavelengths fall from row to row. `first`, `noun`: what the
    first column is called, and what it holds.
    """

    file: str
    header: list[str]
    decimal: str = "."
    falling: bool = False
    first: str = WAVELENGTH
    noun: str = "wavelength"
    faults: list[Fault] = field(default_factory=list)

    def read(self, rows: list[tuple[int, list[str]]]) -> tuple[FloatArray, list[Fault]]:
        """ndarray[n_samples, n_columns], NaN where a cell is no number; and the faults, row by row."""
        values = np.full((len(rows), len(self.header)), np.nan)
        before = np.nan
        for index, (line, row) in enumerate(rows):
            if len(self.faults) >= _MOST_CELL_FAULTS:
                self.faults.append(Fault("too many faults; what follows was not read", self.file, line))
                break
            if len(row) != len(self.header):
                self.add("wrong number of columns", line, None, len(row), str(len(self.header)))
                before = np.nan
                continue
            values[index] = self.row(line, row)
            step = values[index, 0] - before
            if (step >= 0) if self.falling else (step <= 0):
                same = values[index, 0] == before
                problem = f"{self.noun} occurs twice" if same else f"{self.noun}s are not sorted"
                self.add(
                    problem,
                    line,
                    self.first,
                    values[index, 0].item(),
                    "strictly decreasing" if self.falling else "strictly increasing",
                )
            before = values[index, 0]
        return values, self.faults

    def row(self, line: int, row: list[str]) -> list[float]:
        """The numbers of a row, NaN for what is none."""
        if self.decimal != ".":
            row = [cell.replace(self.decimal, ".") for cell in row]
        try:
            if not any(map(_ODD.search, row)):
                numbers = list(map(float, row))
                if min(numbers[1:], default=0.0) >= 0 and max(numbers) <= LARGEST:
                    return [number + 0.0 for number in numbers]
        except ValueError:
            pass  # which cell it is, is found below
        return [
            self.cell(line, name, cell, first=index == 0)
            for index, (name, cell) in enumerate(zip(self.header, row, strict=True))
        ]

    def cell(self, line: int, name: str, cell: str, *, first: bool) -> float:
        """One cell's number, NaN when it is none."""
        number = number_of(cell)
        if number is None:
            comma = "; a decimal comma? use a point" if _DECIMAL_COMMA.fullmatch(cell.strip()) else ""
            self.add("not a usable number", line, name, cell.strip(), f"finite, >= 0{comma}")
            return math.nan
        if not first and number < 0:
            self.add("negative value", line, name, cell.strip(), "finite, >= 0")
        if number > LARGEST:
            self.add("value too large", line, name, cell.strip(), f"0 to {LARGEST:g}")
        return number

    def add(self, problem: str, line: int, key: str | None, value: object, allowed: str) -> None:
        """Add a fault."""
        self.faults.append(Fault(problem, self.file, line, key, value, allowed))


def number_of(cell: str) -> float | None:
    """A finite number as tables have it; Python's own underscores and other scripts' digits are none."""
    number = float(cell) if _NUMBER.fullmatch(cell.strip()) else math.nan
    return number + 0.0 if math.isfinite(number) else None
