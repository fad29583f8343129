"""Tables whose columns know unit and direction, with tracks as a kind of cell."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from .numbers import Span, amount, change, effect, inward, unit_shown

PROVEN = "proven most in "
"""How the row of a proven upper bound begins."""
_SIGNS = {"gain": " ▲", "loss": " ▼", "": ""}
_NARROWEST = 0.6
"""Width of a range on a track, percent."""
_MOST_TICKS = 5
_MOST_WIDE = 120
"""Letters of a line of a terminal."""


@dataclass(frozen=True)
class Axis:
    """Numbers along a track or a figure; `level`: one to mark, such as that of RGGB."""

    name: str = ""
    unit: str = ""
    low: float = 0.0
    high: float = 1.0
    log: bool = False
    level: float | None = None

    def percent(self, value: float) -> float:
        """Return where a number stands, in percent of the way."""
        low, high = self.low, self.high
        if self.log:
            low, high, value = math.log(low), math.log(high), math.log(max(value, low))
        return float(np.clip(100 * (value - low) / ((high - low) or 1.0), 0, 100))

    @property
    def label(self) -> str:
        """Name with the unit that people read."""
        unit = unit_shown(self.unit)[1]
        return f"{self.name} / {unit}".strip(" /") if unit else self.name

    @property
    def ticks(self) -> list[tuple[float, str]]:
        """A few round numbers with their texts."""
        factor = unit_shown(self.unit)[0]
        low, high = factor * self.low, factor * self.high
        if self.log:
            steps = (1,) if high / low > 80 else (1, 2, 5) if high / low > 4 else (1, 1.2, 1.5, 2, 3, 4, 5, 7)
            numbers = [step * 10.0**decade for decade in range(-13, 14) for step in steps]
            numbers = [number for number in numbers if low * 0.999 <= number <= high * 1.001]
        else:
            least = (high - low) / 4 or 1.0
            power = 10 ** math.floor(math.log10(least))
            step = next(factor * power for factor in (1, 2, 2.5, 5, 10) if factor * power >= least * (1 - 1e-9))
            numbers = [
                number * step for number in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)
            ]
        kept = numbers[:: max(1, -(-len(numbers) // _MOST_TICKS))]
        return [(number / factor, f"{number:,.6g}") for number in kept]


@dataclass(frozen=True)
class Column:
    """Label, unit, what is better (`more`, `less`), and the axis of a track.

    `group`: words above several columns; `promise`: a number that at least so much is, rounded down; `base`: what gains
    and losses are against, where no row is.
    """

    label: str
    unit: str = ""
    better: str = ""
    meaning: str = ""
    axis: Axis | None = None
    group: str = ""
    promise: bool = False
    base: float | None = None


@dataclass(frozen=True)
class Marks:
    """A cell on a track: ranges, points with their colors, and what they say."""

    spans: Sequence[Span] = ()
    points: Sequence[tuple[float, str]] = ()
    text: str = ""


@dataclass(frozen=True)
class Cell:
    """A cell as it is shown: text, whether it gains or loses and how much, and its marks in percent of the track."""

    text: str
    kind: str = ""
    against: str = ""
    track: tuple[Span, ...] | None = None
    points: tuple[tuple[float, str], ...] = ()


Value = float | str | Marks | None


def _is_known(value: Value) -> bool:
    return bool(value) if isinstance(value, str | Marks) or value is None else bool(np.isfinite(value))


@dataclass(frozen=True)
class Table:
    """Designs (or lamps, sensors, measures) in rows; the same object is HTML, text, Markdown and a frame.

    `reference`: the row that gains and losses are against; `hero`: the row that answers; `head`: what the rows are.
    """

    columns: Mapping[str, Column]
    rows: Mapping[str, Mapping[str, Value]]
    reference: str = ""
    hero: str = ""
    note: str = ""
    head: str = ""

    @classmethod
    def of(cls, columns: Mapping[str, tuple[Column, Mapping[str, Any]]], **how: Any) -> Table:
        """Return a table from columns with their values by row; a column without values goes away."""
        kept = {key: pair for key, pair in columns.items() if any(map(_is_known, pair[1].values()))}
        names = dict.fromkeys(name for _, values in kept.values() for name in values)
        rows = {name: {key: values.get(name) for key, (_, values) in kept.items()} for name in names}
        return cls({key: column for key, (column, _) in kept.items()}, rows, **how)

    def cell(self, row: str, key: str) -> Cell:
        """Return a cell as it is shown."""
        column, value = self.columns[key], self.rows[row].get(key)
        if isinstance(value, Marks):
            axis = column.axis or Axis()
            spans = [
                (axis.percent(low), max(axis.percent(high) - axis.percent(low), _NARROWEST))
                for low, high in value.spans
            ]
            points = [(axis.percent(x), color) for x, color in value.points]
            return Cell(value.text, track=tuple(spans), points=tuple(points))
        if value is None or isinstance(value, str):
            return Cell(value or "", "words")
        if not np.isfinite(value):
            return Cell("" if np.isnan(value) else "∞")
        proven = row.startswith(PROVEN)
        shown = inward(value, up=proven) if column.promise or proven else value
        of = self.rows.get(self.reference, {}).get(key) if column.base is None else column.base
        if row == self.reference or proven or not isinstance(of, float | int):
            return Cell(amount(shown, column.unit))
        kind = effect(value, of, column.better)
        return Cell(amount(shown, column.unit), kind, change(value, of) if kind else "")

    def quoted(self, key: str, scale: str = "") -> str:
        """Return a figure of the row that answers, with the reference's: `**234 DN** (RGGB 139 DN)`."""
        text = f"**{self.cell(self.hero, key).text}**{scale}"
        if self.reference in (self.hero, "") or self.reference not in self.rows:
            return text
        of = self.cell(self.reference, key).text
        return f"{text} ({self.reference} {of})" if of else text

    @property
    def frame(self) -> pd.DataFrame:
        """The table for a notebook or a file; units and meanings are in `attrs`."""
        plain = {
            name: {key: value.text if isinstance(value, Marks) else value for key, value in row.items()}
            for name, row in self.rows.items()
        }
        frame = pd.DataFrame.from_dict(plain, orient="index", columns=[*self.columns])
        frame.attrs = {key: {"unit": column.unit, "meaning": column.meaning} for key, column in self.columns.items()}
        return frame

    @property
    def text(self) -> list[list[str]]:
        """Header and rows as texts."""
        head = [self.head, *(f"{column.group} {column.label}".strip() for column in self.columns.values())]
        lines = [
            [row, *(cell.text + _SIGNS.get(cell.kind, "") for cell in (self.cell(row, key) for key in self.columns))]
            for row in self.rows
        ]
        return [head, *lines]

    @property
    def lines(self) -> list[str]:
        """The table for a terminal: as many columns as a line holds, below the words of their groups."""
        said = [at for at, key in enumerate(self.columns) if any(self.cell(row, key).text for row in self.rows)]
        columns, texts = [[*self.columns.values()][at] for at in said], self.text[1:]
        groups = ["", *(c.group if at == 0 or columns[at - 1].group != c.group else "" for at, c in enumerate(columns))]
        rows = [groups] if any(groups) else []
        rows += [[self.head, *(column.label for column in columns)]]
        rows += [[line[0], *(line[at + 1] for at in said)] for line in texts]
        cells = [[cell.replace("\u00a0", " ") for cell in line] for line in rows]
        widths = [max(len(line[at]) for line in cells[bool(any(groups)) :]) for at in range(len(columns) + 1)]
        kept = max(2, sum(np.cumsum(np.array(widths) + 2) <= _MOST_WIDE + 2))
        lines = []
        for line in cells:
            text = ""
            for at in range(kept):
                apart = "  " if text.strip() and line[at] else ""
                text = f"{(text + apart).ljust(sum(widths[:at]) + 2 * at)}{line[at]}"
            lines.append(text.rstrip()[:_MOST_WIDE])
        return lines

    @property
    def markdown(self) -> str:
        """The table for a document."""
        head, *rows = self.text
        return "\n".join(f"| {' | '.join(line)} |" for line in (head, ["---"] * len(head), *rows)).replace(
            "\u00a0", " "
        )


def aligned(frame: pd.DataFrame) -> list[str]:
    """Return a data frame as lines of text; a missing value is a dash."""
    cells = [[str(name) for name in frame.columns]]
    cells += [[_plain(value) for value in row] for row in frame.itertuples(index=False)]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    return ["  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip() for line in cells]


def _plain(value: object) -> str:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "-"
    return f"{value:g}" if isinstance(value, float) else str(value)
