"""Panels of figures as plain values, and how each is drawn: lines, dots, ranges, curves over lamps, maps."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from ..base.types import Array, Float
from .look import (
    DIM,
    FORBIDDEN,
    GAIN,
    GRID,
    INK,
    LAMPS,
    LOSS,
    Style,
    font,
    is_wide,
    label_ends,
    log_axis,
    offset,
    place,
    png_of,
    sheet,
    styles_of,
    svg_of,
    words_at,
    wrapped,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Values = Float[Array, " numbers"]
Pairs = tuple[Float[Array, " _points"], Float[Array, " _points"]]
_ABOVE, _BELOW, _LEFT = 34, 52, 62
"""Room of a panel for its title, its axis and its numbers, px."""
_ROW = 34
"""Height of a row of dots or bars, px."""


class Panel(Protocol):
    """One pair of axes of a figure."""

    @property
    def title(self) -> str:
        """What it shows, with its unit."""

    def room(self, *, wide: bool) -> tuple[float, float]:
        """Return the width on the left for numbers and names, and on the right for words, px."""

    def tall(self, *, wide: bool) -> float:
        """Return the height of the axes, px."""

    def draw(self, axes: Axes) -> None:
        """Draw it."""


@dataclass(frozen=True)
class Picture:
    """Panels row by row, below each other on a narrow screen, with what cannot be seen in them.

    `alone`: what the picture shows, for who does not see it; `columns`: panels side by side; all where it is 0.
    """

    panels: tuple[Panel, ...]
    alone: str
    caption: str = ""
    columns: int = 0

    def svgs(self, name: str) -> tuple[str, str]:
        """Return the picture for a wide and for a narrow screen."""
        return self._svg(name, wide=True), self._svg(name, wide=False)

    def _svg(self, name: str, *, wide: bool) -> str:
        return svg_of(self.figure(wide=wide), f"{name}-{'wide' if wide else 'narrow'}", self.alone)

    def files(self, name: str) -> dict[str, bytes]:
        """Return the picture as files, SVG and PNG."""
        return {f"{name}.svg": self._svg(name, wide=True).encode(), f"{name}.png": png_of(self.figure())}

    def figure(self, *, wide: bool = True) -> Figure:
        """Draw it."""
        columns = (self.columns or len(self.panels)) if wide else 1
        lines = [self.panels[at : at + columns] for at in range(0, len(self.panels), columns)]
        heights = [max(panel.tall(wide=wide) for panel in line) + _ABOVE + _BELOW for line in lines]
        figure = sheet(wide, sum(heights))
        top, width = 0.0, 72 * float(figure.get_size_inches()[0]) / columns
        for line, height in zip(lines, heights, strict=True):
            sides = [
                max(panel.room(wide=wide)[side] for panel in self.panels) if columns == 1 else None for side in (0, 1)
            ]
            for at, panel in enumerate(line):
                left, right = (
                    own if side is None else side for own, side in zip(panel.room(wide=wide), sides, strict=True)
                )
                axes = place(figure, at * width + left, top + _ABOVE, width - left - right - 12, panel.tall(wide=wide))
                title = panel.title if wide else "\n".join(textwrap.wrap(panel.title, 44))
                axes.text(0, 1, title, transform=axes.transAxes + offset(axes, 0, 12), fontsize=font(figure),
                          fontweight="bold", color=INK)  # fmt: skip
                panel.draw(axes)
            top += height
        return figure


def right_of(names: Iterable[str], *, wide: bool) -> float:
    """Return the width of names at the ends of lines, px; on a narrow screen they are wrapped."""
    longest = max((len(part) for name in names for part in (name if wide else wrapped(name)).split("\n")), default=0)
    return 20 + (7.4 if wide else 6.4) * longest


@dataclass(frozen=True)
class Line:
    """Values over numbers; `upper`: the other end of a band."""

    x: Values
    y: Values
    upper: Values | None = None


@dataclass(frozen=True)
class Ring:
    """A place where the answer loses, or a crossing, with its number."""

    x: float
    y: float
    text: str = ""


@dataclass(frozen=True)
class Lines:
    """A line for each name over a number, with names at their ends.

    `bold`: the name that answers; `level`: a height and its words; `zone`: a range of heights that is not allowed, and
    its words; `beyond`: a number from which on nothing is asked; `ticks`: heights and their words.
    """

    title: str
    x_label: str
    lines: Mapping[str, Line]
    bold: str = ""
    log_x: bool = False
    log_y: bool = False
    level: tuple[float, str] | None = None
    zone: tuple[float, float, str] | None = None
    band: tuple[float, float, str] | None = None
    rings: tuple[Ring, ...] = ()
    ticks: tuple[tuple[float, str], ...] = ()
    marked: bool = True
    height: float = 320
    left: float = _LEFT

    def room(self, *, wide: bool) -> tuple[float, float]:
        """Numbers on the left, names on the right."""
        return self.left, right_of(self.lines, wide=wide)

    def tall(self, *, wide: bool) -> float:
        """As stated, or lower."""
        return self.height if wide else 230

    def draw(self, axes: Axes) -> None:
        """Draw lines, marks and names."""
        styles = styles_of(self.lines)
        x = np.concatenate([line.x for line in self.lines.values()])
        y = np.concatenate([line.y for line in self.lines.values()])
        known = y[np.isfinite(y)]
        low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)
        if self.level is not None:
            low, high = min(low, self.level[0]), max(high, self.level[0])
        if self.log_x:
            log_axis(axes, "x", float(x.min()), float(x.max()))
        axes.set_xlim(float(x.min()), float(x.max()))
        if self.log_y:
            low, high = low / 1.5, high * 1.7
            log_axis(axes, "y", low, high)
        else:
            low, high = min(0.0, low) - 0.02 * (high - low), high + 0.08 * (high - min(0.0, low) or 1.0)
        if self.ticks:
            axes.set_yticks([height for height, _ in self.ticks], [text for _, text in self.ticks])
        if self.zone is not None:
            axes.axhspan(self.zone[0], self.zone[1], color=FORBIDDEN, linewidth=0, zorder=0)
            words_at(
                axes,
                self.zone[2],
                *_inside(axes, 0.98, 0.0)[:1],
                np.sqrt(self.zone[0] * self.zone[1]),
                ha="right",
                color=LOSS,
            )
        if self.band is not None:
            axes.axvspan(self.band[0], self.band[1], color=FORBIDDEN, linewidth=0, zorder=0)
            middle = np.sqrt(self.band[0] * self.band[1]) if self.log_x else (self.band[0] + self.band[1]) / 2
            axes.text(middle, 0.5, self.band[2], transform=axes.get_xaxis_transform(), ha="center", va="center",
                      color=LOSS, fontsize=font(axes.figure))  # type: ignore[arg-type]  # fmt: skip
        for name, line in self.lines.items():
            style, bold = styles[name], name == self.bold
            if line.upper is not None:
                axes.fill_between(line.x, line.y, line.upper, color=style.color, alpha=0.14, linewidth=0)
            axes.plot(line.x, line.y, linestyle=style.dash, color=style.color, linewidth=3.2 if bold else 1.7,
                      marker=style.marker if self.marked else "", markersize=4.5, zorder=4 if bold else 3)  # fmt: skip
        ends = {name: (_end(line.y), styles[name], name == self.bold) for name, line in self.lines.items()}
        label_ends(axes, {name: end for name, end in ends.items() if np.isfinite(end[0])}, (low, high))
        if self.level is not None:
            axes.axhline(self.level[0], color=INK, linestyle=(0, (1, 2)), linewidth=1.2)
            axes.text(0.01, self.level[0], self.level[1], transform=axes.get_yaxis_transform(), va="bottom", color=INK,
                      fontsize=font(axes.figure) - 1)  # type: ignore[arg-type]  # fmt: skip
        for ring in self.rings:
            axes.plot(ring.x, ring.y, "o", markersize=9, markerfacecolor="white", markeredgecolor=LOSS,
                      markeredgewidth=2, zorder=6, clip_on=False)  # fmt: skip
            words_at(axes, f" {ring.text}", ring.x, ring.y, color=LOSS, fontweight="bold", va="bottom", zorder=7)
        axes.set_xlabel(self.x_label, fontsize=font(axes.figure), color=INK)  # type: ignore[arg-type]


def _end(y: Values) -> float:
    """Return the last height that is known."""
    known = y[np.isfinite(y)]
    return float(known[-1]) if known.size else np.nan


def _inside(axes: Axes, x: float, y: float) -> tuple[float, float]:
    """Return the data at shares of the axes."""
    there = axes.transData.inverted().transform(axes.transAxes.transform((x, y)))
    return float(there[0]), float(there[1])


@dataclass(frozen=True)
class Curves:
    """Curves over wavelength, with the lamps behind them and names at their peaks.

    `edges`: wavelengths to mark, nm.
    """

    title: str
    wavelength_nm: Values
    curves: Mapping[str, Values]
    lamps: Mapping[str, Values]
    colors: Mapping[str, str]
    bold: tuple[str, ...] = ()
    dashed: tuple[str, ...] = ()
    edges: tuple[float, ...] = ()
    height: float = 320

    def room(self, *, wide: bool) -> tuple[float, float]:  # noqa: ARG002
        """Numbers on the left."""
        return _LEFT, 6

    def tall(self, *, wide: bool) -> float:
        """As stated, or lower."""
        return self.height if wide else 230

    def draw(self, axes: Axes) -> None:
        """Draw lamps, curves and names."""
        size, nm = font(axes.figure), self.wavelength_nm  # type: ignore[arg-type]
        top = max([1e-9, *(float(curve.max()) for curve in self.curves.values())])
        axes.set_xlim(float(nm[0]), float(nm[-1]))
        axes.set_ylim(0, 1.22 * top if self.edges else 1.12 * top)
        for kind, lamp in self.lamps.items():
            axes.fill_between(nm, 1.06 * top * lamp, color=LAMPS.get(kind, "#bbbbbb"), alpha=0.45, linewidth=0)
        for name, curve in self.curves.items():
            bold = name in self.bold
            axes.plot(nm, curve, color=self.colors[name], linewidth=3.2 if bold else 1.7, zorder=4 if bold else 3,
                      linestyle=(0, (5, 2)) if name in self.dashed else "-")  # fmt: skip
            others = [other for known, other in self.curves.items() if known != name]
            apart = np.min([np.abs(curve - other) for other in others], axis=0) if others else curve
            margin = min(8, (nm.size - 1) // 4)
            at = int(np.argmax(np.where(curve > 0.25 * top, apart, -1.0)[margin : nm.size - margin])) + margin
            words_at(axes, name, float(nm[at]), float(curve[at]), color=self.colors[name], ha="center",
                     fontweight="bold" if bold else "normal", va="bottom", zorder=5)  # fmt: skip
        for edge in self.edges:
            axes.axvline(edge, color=GAIN, linestyle=(0, (2, 2)), linewidth=1.2)
        for edge, side in zip(self.edges, ("right", "left") * len(self.edges), strict=False):
            axes.text(
                edge, 1.17 * top, f" {edge:.0f} nm ", ha=side, va="bottom", color=GAIN, fontsize=size, fontweight="bold"
            )
        axes.set_xlabel("wavelength / nm", fontsize=size, color=INK)


@dataclass(frozen=True)
class Point:
    """A CFA or design."""

    name: str
    x: float
    y: float
    text: str


@dataclass(frozen=True)
class Scatter:
    """Points by name, a cloud of others, optima and an upper bound, and a level of reference."""

    title: str
    x_label: str
    points: tuple[Point, ...]
    bold: str = ""
    cloud: Pairs | None = None
    traced: Pairs | None = None
    bound: Pairs | None = None
    level: float | None = None
    lines: tuple[float, float] | None = None
    height: float = 320
    left: float = _LEFT

    def room(self, *, wide: bool) -> tuple[float, float]:
        """Numbers on the left, names on the right."""
        return self.left, right_of((point.text for point in self.points), wide=wide)

    def tall(self, *, wide: bool) -> float:
        """As stated, or lower."""
        return self.height if wide else 260

    def draw(self, axes: Axes) -> None:
        """Draw points, lines and names."""
        styles = styles_of(point.name for point in self.points)
        if self.cloud is not None:
            axes.plot(*self.cloud, "o", color="#7aa7e0", markersize=3, alpha=0.6, markeredgewidth=0)
        if self.bound is not None:
            axes.plot(*self.bound, color=DIM, linestyle=(0, (5, 3)), linewidth=1.4, drawstyle="steps-post")
            at = int(np.argmax(self.bound[1]))
            words_at(
                axes,
                "upper bound ",
                float(self.bound[0][at]),
                float(self.bound[1][at]),
                color=DIM,
                ha="right",
                va="bottom",
            )
        if self.traced is not None:
            axes.plot(*self.traced, color=styles[self.bold].color if self.bold else GAIN, linewidth=2.4)
        if self.level is not None:
            axes.axhline(self.level, color=INK, linestyle=(0, (1, 2)), linewidth=1.2)
        for point in self.points:
            style, bold = styles[point.name], point.name == self.bold
            axes.plot(point.x, point.y, style.marker, color=style.color, markersize=13 if bold else 8, zorder=5,
                      markeredgecolor="white", markeredgewidth=0.8)  # fmt: skip
        for number, line in zip(self.lines or (), (axes.axhline, axes.axvline), strict=False):
            line(number, color=INK, linestyle=(0, (1, 2)), linewidth=1.2)
        axes.margins(0.08)
        low, high = axes.get_ylim()
        axes.set_ylim(min(0.0, low) if low < 0.5 * high else low, high + 0.05 * (high - low))
        ends = {point.text: (point.y, styles[point.name], point.name == self.bold) for point in self.points}
        label_ends(axes, ends, axes.get_ylim())
        axes.set_xlabel(self.x_label, fontsize=font(axes.figure), color=INK)  # type: ignore[arg-type]


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
class Map:
    """Heights over two numbers, with levels and a marked place; NaN where nothing is known or allowed.

    `levels`: heights and their words; `mark`: place and words.
    """

    title: str
    x_label: str
    y_label: str
    x: Float[Array, " columns"]
    y: Float[Array, " rows"]
    z: Float[Array, "rows columns"]
    levels: tuple[tuple[float, str], ...] = ()
    mark: tuple[float, float, str] | None = None
    most: float | None = None
    height: float = 340

    def room(self, *, wide: bool) -> tuple[float, float]:  # noqa: ARG002
        """Numbers on the left."""
        return _LEFT, 12

    def tall(self, *, wide: bool) -> float:
        """As stated, or lower."""
        return self.height if wide else 270

    def draw(self, axes: Axes) -> None:
        """Draw heights, levels and the mark."""
        from matplotlib.colors import LinearSegmentedColormap  # noqa: PLC0415  (slow to import)

        blues = LinearSegmentedColormap.from_list("heights", ["#eef4fc", "#9dc0ee", "#4f8add", "#065dcb", "#04408c"])
        size = font(axes.figure)  # type: ignore[arg-type]
        axes.set_facecolor("#eeeeee")
        axes.grid(visible=False)
        axes.imshow(
            self.z, cmap=blues, origin="lower", aspect="auto", interpolation="nearest", vmin=0, vmax=self.most,
            extent=(*_outer(self.x), *_outer(self.y)),
        )  # fmt: skip
        for level, words in self.levels:
            if min(self.z.shape) > 1 and np.nanmin(self.z) < level <= np.nanmax(self.z):
                drawn = axes.contour(self.x, self.y, self.z, levels=[level], colors=INK, linewidths=1.4)
                axes.clabel(drawn, fmt=words, fontsize=size - 2)
        if self.mark is not None:
            axes.plot(*self.mark[:2], "*", color="white", markersize=15, markeredgecolor=INK)
            axes.annotate(
                self.mark[2], self.mark[:2], xytext=(8, 8), textcoords="offset points", fontsize=size, color=INK,
                fontweight="bold", bbox={"facecolor": "white", "alpha": 0.8, "edgecolor": "none", "pad": 1},
            )  # fmt: skip
        axes.set_xlabel(self.x_label, fontsize=size, color=INK)
        axes.set_ylabel(self.y_label, fontsize=size, color=INK)


def _outer(values: Values) -> tuple[float, float]:
    """Return the outer ends of cells around equidistant numbers."""
    half = (float(values[-1]) - float(values[0])) / max(1, len(values) - 1) / 2 or 0.5
    return float(values[0]) - half, float(values[-1]) + half


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
        return (16 + 7.2 * max(map(len, self._rows)) if wide else 8), 12

    def draw(self, axes: Axes) -> None:
        """Draw marks, intervals and a key above them."""
        names, rows = [*dict.fromkeys(ratio.name for ratio in self.ratios)], self._rows
        styles, size = styles_of(names), font(axes.figure)  # type: ignore[arg-type]
        known = [v for r in self.ratios for v in (r.value, r.low, r.high) if v is not None and v > 0]
        low, high = min([0.5, *known]), max([2.0, *known])
        log_axis(axes, "x", low, high)
        axes.set_xlim(low / 1.1, high * 1.1)
        axes.set_ylim(len(rows) - 0.3, -1.4 if is_wide(axes) else -2.2)
        axes.axvspan(low / 1.1, 1, color=FORBIDDEN, linewidth=0, zorder=0)
        axes.axvline(1, color=INK, linewidth=1.2)
        for one in self.ratios:
            style, bold = styles[one.name], one.name == self.bold
            apart = 0.7 * (names.index(one.name) / max(1, len(names) - 1) - 0.5) * (len(names) > 1)
            y = rows.index(one.row) + apart
            if one.low is not None and one.high is not None:
                axes.plot((one.low, one.high), (y, y), color=style.color, linewidth=3, alpha=0.4, solid_capstyle="butt")
            axes.plot(
                one.value,
                y,
                style.marker,
                color=style.color,
                markersize=10 if bold else 7,
                markeredgecolor="white",
                zorder=5,
            )
        _name_rows(axes, dict.fromkeys(rows, INK), "")
        axes.grid(visible=True, axis="y", color=GRID, linewidth=0.8)
        columns = min(len(names), 4 if is_wide(axes) else 2)
        for at, name in enumerate(names):  # a key, mark by mark
            x, y = (at % columns + 0.06) / columns, -0.95 - 0.5 * (at // columns)
            color, marker, along = styles[name].color, styles[name].marker, axes.get_yaxis_transform()
            axes.plot(x, y, marker, color=color, markersize=7, clip_on=False, transform=along, zorder=6)
            axes.text(x + 0.02, y, name, fontsize=size - 2, color=styles[name].ink, va="center", transform=along)
        axes.set_xlabel(self.x_label, fontsize=size, color=INK)
