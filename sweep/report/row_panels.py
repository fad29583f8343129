"""Panels with a row for each name: worst and nominal values, intervals, usable ranges, and ratios."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .look import (
    DIM,
    FORBIDDEN,
    GAIN,
    GRID,
    INK,
    LOSS,
    Style,
    font,
    is_wide,
    log_axis,
    offset,
    styles_of,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_ROW = 34
"""Height of a row of dots or bars, px."""


@dataclass(frozen=True)
class Row:
    """A name with a value from its worst to its nominal one, or with an interval, and words on its right."""

    name: str
    value: float
    other: float | None = None
    low: float | None = None
    high: float | None = None
    text: str = ""
    lost: bool = False


@dataclass(frozen=True)
class Rows:
    """One row for each name: a dot, or two (filled: the worst case; open: the nominal one), or intervals.

    `level`: a number to compare with, and its words.
    """

    title: str
    x_label: str
    rows: tuple[Row, ...]
    bold: str = ""
    level: tuple[float, str] | None = None
    bound: float | None = None
    log_x: bool = False
    right: str = ""
    plain: bool = False

    def tall(self, *, wide: bool) -> float:
        """Return a row each; on a narrow screen with its name above it."""
        return (_ROW if wide else 1.25 * _ROW) * (len(self.rows) + 0.3)

    def room(self, *, wide: bool) -> tuple[float, float]:
        """Names on the left, words on the right."""
        right = max((len(row.text) for row in self.rows), default=0)
        left = 18 + 7.6 * max(len(row.name) for row in self.rows) if wide else 10
        return left, 12 + (7.6 if wide else 6.6) * max(right, len(self.right)) if right else 24

    def draw(self, axes: Axes) -> None:
        """Draw dots, intervals, names and words."""
        styles, size = styles_of(row.name for row in self.rows), font(axes.figure)  # type: ignore[arg-type]
        axes.set_ylim(len(self.rows) - 0.4, -0.7)
        numbers = [
            v
            for row in self.rows
            for v in (row.value, row.other, row.low, row.high)
            if v is not None and np.isfinite(v)
        ]
        numbers += [] if self.level is None else [self.level[0]]
        numbers += [] if self.bound is None else [self.bound]
        low, high = min(numbers), max(numbers)
        if self.log_x:
            log_axis(axes, "x", low, high)
            axes.set_xlim(low / 1.12, high * 1.12)
        else:
            axes.set_xlim(min(0.0, low), high + 0.06 * (high - min(0.0, low)))
        for at, row in enumerate(self.rows):
            style = Style(INK) if self.plain else styles[row.name]
            color = (LOSS if row.lost else GAIN) if self.plain else style.color
            start, stop = (row.value, row.other) if row.other is not None else (row.low, row.high)
            if start is not None and stop is not None:
                axes.plot((start, stop), (at, at), color=color, linewidth=6, alpha=0.3, solid_capstyle="butt")
            if row.other is not None:
                axes.plot(
                    row.other,
                    at,
                    style.marker,
                    markersize=9,
                    markerfacecolor="white",
                    markeredgecolor=color,
                    markeredgewidth=2,
                )
            axes.plot(row.value, at, style.marker, color=color, markersize=9, markeredgecolor="white", zorder=5)
            axes.text(1.012, at, row.text, transform=axes.get_yaxis_transform(), va="center", fontsize=size,
                      color=INK if self.plain else style.ink)  # fmt: skip
        inks = {row.name: INK if self.plain else styles[row.name].ink for row in self.rows}
        _name_rows(axes, inks, self.bold)
        if self.level is not None:
            axes.axvline(self.level[0], color=INK, linestyle=(0, (1, 2)), linewidth=1.2, zorder=1)
            side = "right" if self.level[0] > sum(axes.get_xlim()) / 2 else "left"
            words = f" {self.level[1]} " if is_wide(axes) else ""
            axes.text(self.level[0], -0.68, words, ha=side, va="top", fontsize=size - 1, color=INK)
        if self.bound is not None:
            axes.axvline(self.bound, color=DIM, linestyle=(0, (5, 3)), linewidth=1.4, zorder=1)
            side = "right" if self.bound > 0.7 * axes.get_xlim()[1] else "left"
            words = " upper bound of the worst case "
            axes.text(self.bound, -0.68, words, ha=side, va="top", fontsize=size - 1, color=DIM)
        if self.right:
            axes.text(
                1.012, 1, self.right, transform=axes.transAxes + offset(axes, 0, 12), fontsize=size - 1, color=DIM
            )
        axes.set_xlabel(self.x_label, fontsize=size, color=INK)


def _name_rows(axes: Axes, inks: Mapping[str, str], bold: str) -> None:
    """Write the names of rows left of these, or on a narrow screen above them."""
    axes.set_yticks(range(len(inks)), [""] * len(inks))
    axes.spines["left"].set_visible(False)
    axes.grid(visible=False, axis="y")
    wide = is_wide(axes)
    for at, (name, ink) in enumerate(inks.items()):
        axes.text(0, at if wide else at - 0.48, name, va="center", ha="right" if wide else "left",
                  transform=axes.get_yaxis_transform() + offset(axes, -10 if wide else 0, 0),
                  color=ink, fontsize=font(axes.figure), fontweight="bold" if name == bold else "normal")  # type: ignore[arg-type]  # fmt: skip


@dataclass(frozen=True)
class Bar:
    """Usable ranges of a name, numbers at which a channel hands over, and at which one is full."""

    name: str
    ranges: tuple[tuple[float, float], ...]
    text: str
    strokes: tuple[float, ...] = ()
    full: tuple[float, ...] = ()


@dataclass(frozen=True)
class Bars:
    """Ranges in which each name is usable."""

    title: str
    x_label: str
    bars: tuple[Bar, ...]
    ends: tuple[float, float]
    log_x: bool = True
    bold: str = ""

    def tall(self, *, wide: bool) -> float:
        """Return a row each; on a narrow screen with its name and its ranges above it."""
        return (_ROW if wide else 2.1 * _ROW) * (len(self.bars) + 0.3)

    def room(self, *, wide: bool) -> tuple[float, float]:
        """Names on the left, ranges on the right."""
        if not wide:
            return 10, 10
        return 18 + 7.6 * max(len(bar.name) for bar in self.bars), 14 + 7.4 * max(len(bar.text) for bar in self.bars)

    def draw(self, axes: Axes) -> None:
        """Draw bars, strokes, crosses and names."""
        styles, size = styles_of(bar.name for bar in self.bars), font(axes.figure)  # type: ignore[arg-type]
        axes.set_ylim(len(self.bars) - 0.4, -0.7)
        if self.log_x:
            log_axis(axes, "x", *self.ends)
        axes.set_xlim(*self.ends)
        for at, bar in enumerate(self.bars):
            style, bold = styles[bar.name], bar.name == self.bold
            for low, high in bar.ranges:
                start, stop = max(low, self.ends[0]), min(high, self.ends[1])
                axes.barh(at - 0.1, stop - start, left=start, height=0.42, color=style.color, alpha=0.85, linewidth=0)
            axes.plot(bar.strokes, [at + 0.28] * len(bar.strokes), "|", color=DIM, markersize=6)
            axes.plot(bar.full, [at + 0.28] * len(bar.full), "x", color=LOSS, markersize=6, markeredgewidth=1.8)
            x, y, side = (1.012, at - 0.1, "left") if is_wide(axes) else (1, at + 0.38, "right")
            axes.text(x, y, bar.text, transform=axes.get_yaxis_transform(), va="center", ha=side, fontsize=size,
                      color=style.ink, fontweight="bold" if bold else "normal")  # fmt: skip
        _name_rows(axes, {bar.name: styles[bar.name].ink for bar in self.bars}, self.bold)
        axes.set_xlabel(self.x_label, fontsize=size, color=INK)


@dataclass(frozen=True)
class Ratio:
    """Ratio of a design in a row, and the ends of its interval, where they are known."""

    row: str
    name: str
    value: float
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True)
class Ratios:
    """Ratios against a reference: a row for each sensor or figure, a mark with its interval for each design.

    `bold`: the design that answers; `pitch`: height of a row, px.
    """

    title: str
    x_label: str
    ratios: tuple[Ratio, ...]
    bold: str = ""
    pitch: float = 34

    @property
    def _rows(self) -> list[str]:
        return [*dict.fromkeys(ratio.row for ratio in self.ratios)]

    def tall(self, *, wide: bool) -> float:
        """Return a row each; on a narrow screen with its name above it."""
        return (self.pitch if wide else max(self.pitch, 34)) * (len(self._rows) + 1.6)

    def room(self, *, wide: bool) -> tuple[float, float]:
        """Names of rows on the left."""
        return (16 + 7.2 * max(map(len, self._rows), default=0) if wide else 8), 12

    def draw(self, axes: Axes) -> None:
        """Draw marks, intervals and a key above them."""
        names, rows = [*dict.fromkeys(ratio.name for ratio in self.ratios)], self._rows
        styles, size = styles_of(names), font(axes.figure)  # type: ignore[arg-type]
        known = [v for r in self.ratios for v in (r.value, r.low, r.high) if v is not None and v > 0]
        low, high = min([0.5, *known]), max([2.0, *known])
        log_axis(axes, "x", low, high)
        axes.set_xlim(low / 1.1, high * 1.1)
        width_px = 72 * axes.get_position().width * float(axes.figure.get_size_inches()[0])  # type: ignore[union-attr]
        columns = max(1, min(len(names), int(width_px / (24 + 0.5 * (size - 2) * max(map(len, names), default=1)))))
        axes.set_ylim(len(rows) - 0.3, -0.9 - 0.5 * -(-len(names) // columns))
        below, above = axes.get_ylim()
        share = (below + 0.6) / (below - above)  # the key stands above the rows
        axes.axvspan(low / 1.1, 1, 0, share, color=FORBIDDEN, linewidth=0, zorder=0)
        axes.axvline(1, 0, share, color=INK, linewidth=1.2)
        for one in self.ratios:
            style, bold = styles[one.name], one.name == self.bold
            here = [name for name in names if any((r.row, r.name) == (one.row, name) for r in self.ratios)]
            apart = 0.7 * (here.index(one.name) / max(1, len(here) - 1) - 0.5) * (len(here) > 1)
            y = rows.index(one.row) + apart
            if one.low is not None and one.high is not None:
                axes.plot((one.low, one.high), (y, y), color=style.color, linewidth=3, alpha=0.4, solid_capstyle="butt")
            axes.plot(
                one.value,
                y,
                style.marker,
                color=style.color,
                markersize=11 if bold else 8,
                markeredgecolor="white",
                zorder=5,
            )
        _name_rows(axes, dict.fromkeys(rows, INK), "")
        axes.grid(visible=True, axis="y", color=GRID, linewidth=0.8)
        for at, name in enumerate(names):  # a key, mark by mark
            x, y = (at % columns + 0.06) / columns, -0.95 - 0.5 * (at // columns)
            color, marker, along = styles[name].color, styles[name].marker, axes.get_yaxis_transform()
            axes.plot(x, y, marker, color=color, markersize=7, clip_on=False, transform=along, zorder=6)
            axes.text(x + 0.02, y, name, fontsize=size - 2, color=styles[name].ink, va="center", transform=along)
        axes.set_xlabel(self.x_label, fontsize=size, color=INK)
