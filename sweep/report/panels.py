"""Panels of figures as plain values, and how each is drawn: lines, curves over lamps, maps."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from ..base.types import Array, Float
from .look import (
    FORBIDDEN,
    GAIN,
    INK,
    LAMPS,
    LOSS,
    Style,
    font,
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
_ABOVE, _BELOW, LEFT = 34, 52, 62
"""Room of a panel for its title, its axis and its numbers, px."""
_MOST_MARGIN, _PX_PER_LETTER = 0.7, 8.5
"""Share of a panel's width that names may take, and the width of a letter; longer names are cut."""


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
                max(panel.room(wide=wide)[side] for panel in self.panels) if wide and columns == 1 else None
                for side in (0, 1)
            ]
            for at, panel in enumerate(line):
                left, right = (
                    own if side is None else side for own, side in zip(panel.room(wide=wide), sides, strict=True)
                )
                fits = min(1.0, _MOST_MARGIN * width / (left + right))
                left, right = fits * left, fits * right
                axes = place(figure, at * width + left, top + _ABOVE, width - left - right - 12, panel.tall(wide=wide))
                title = panel.title if wide else "\n".join(textwrap.wrap(panel.title, 44))
                axes.text(0, 1, title, transform=axes.transAxes + offset(axes, 0, 12), fontsize=font(figure),
                          fontweight="bold", color=INK)  # fmt: skip
                panel.draw(axes)
                for text in axes.texts if fits < 1 else ():
                    letters = int(max(left, right) / _PX_PER_LETTER)
                    text.set_text("\n".join(_cut(line, letters) for line in text.get_text().split("\n")))
            top += height
        return figure


def _cut(line: str, letters: int) -> str:
    return line if len(line) <= letters else f"{line[: letters - 1]}\u2026"


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
    below: bool = False


@dataclass(frozen=True)
class Lines:
    """A line for each name over a number, with names at their ends.

    `bold`: the name that answers; `level`: a height and its words; `zone`: a range of heights that is not allowed, and
    its words; `band`: a range of numbers, and its words; `ticks`: heights and their words; `most`: the least upper end.
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
    left: float = LEFT
    most: float = 0.0

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
        known = y[np.isfinite(y) & (y > 0)] if self.log_y else y[np.isfinite(y)]
        low, high = (float(known.min()), float(known.max())) if known.size else (0.1 * self.log_y, 1.0)
        if self.level is not None:
            low, high = min(low, self.level[0]), max(high, self.level[0])
        if self.log_x:
            log_axis(axes, "x", float(x.min()), float(x.max()))
        axes.set_xlim(float(x.min()), float(x.max()))
        if self.log_y:
            low, high = low / 1.5, high * 1.7
            log_axis(axes, "y", low, high)
        else:
            low, high = min(0.0, low), max(high, self.most)
            low, high = low - 0.02 * (high - low), high + 0.08 * (high - low or 1.0)
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
        axes.set_ylim(low, high)
        ends = {name: (_end(line.y), styles[name], name == self.bold) for name, line in self.lines.items()}
        inside = _label_inside(axes, self.lines, styles, self.bold)
        label_ends(axes, {n: end for n, end in ends.items() if np.isfinite(end[0]) and n not in inside}, (low, high))
        if self.level is not None:
            axes.axhline(self.level[0], color=INK, linestyle=(0, (1, 2)), linewidth=1.2)
            far = [np.min([abs(np.log(abs(line.y[end]) / self.level[0])) for line in self.lines.values()
                           if np.isfinite(line.y[end]) and line.y[end]] or [0.0]) for end in (0, -1)]  # fmt: skip
            where, side = (0.01, "left") if far[0] > far[1] else (0.99, "right")
            axes.text(where, self.level[0], self.level[1], transform=axes.get_yaxis_transform(), va="bottom", color=INK,
                      ha=side, fontsize=font(axes.figure) - 1)  # type: ignore[arg-type]  # fmt: skip
        for ring in self.rings:
            axes.plot(ring.x, ring.y, "o", markersize=9, markerfacecolor="white", markeredgecolor=LOSS,
                      markeredgewidth=2, zorder=6, clip_on=False)  # fmt: skip
            words_at(axes, f" {ring.text}", ring.x, ring.y, color=LOSS, fontweight="bold",
                     va="top" if ring.below else "bottom", zorder=7)  # fmt: skip
        axes.set_xlabel(self.x_label, fontsize=font(axes.figure), color=INK)  # type: ignore[arg-type]


def _end(y: Values) -> float:
    """Return the last height that is known."""
    known = y[np.isfinite(y)]
    return float(known[-1]) if known.size else np.nan


def _label_inside(axes: Axes, lines: Mapping[str, Line], styles: Mapping[str, Style], bold: str) -> set[str]:
    """Write names whose lines end where others end at the place where their lines are farthest from all others."""
    to_px = axes.transData.transform
    (left, _), (right, high) = (to_px((axes.get_xlim()[end], axes.get_ylim()[end])) for end in (0, 1))
    along = np.linspace(left + 0.06 * (right - left), left + 0.85 * (right - left), 60)
    heights, last = dict[str, Values](), dict[str, float]()
    for name, line in lines.items():
        known = np.isfinite(line.y)
        if known.any():
            px = to_px(np.column_stack([line.x[known], np.clip(line.y[known], *axes.get_ylim())]))
            heights[name], last[name] = np.interp(along, px[:, 0], px[:, 1], np.nan, np.nan), float(px[-1, 1])
    written, size = list[tuple[float, float]](), font(axes.figure)  # type: ignore[arg-type]
    inside = set[str]()
    for name, mine in heights.items():
        others = [height for other, height in heights.items() if other != name]
        if not others or min(abs(last[name] - end) for other, end in last.items() if other != name) > 0.6 * size:
            continue
        near = np.nan_to_num(np.fmin.reduce([np.abs(mine - other) for other in others]))
        for there, height in written:
            near = np.where(np.abs(along - there) < 7 * size, np.minimum(near, np.abs(mine - height)), near)
        half = 0.3 * size * len(name)
        near = np.where(np.isfinite(mine) & (along > left + half) & (along < right - half), near, -1.0)
        at = int(np.argmax(near))
        if near[at] < 1.4 * size:
            continue
        above = high - mine[at] > 2 * size and not any(0 < other[at] - mine[at] < 3 * size for other in others)
        x, y = axes.transData.inverted().transform((along[at], mine[at] + (0.4 if above else -0.4) * size))
        words_at(axes, name, float(x), float(y), color=styles[name].ink, ha="center", va="bottom" if above else "top",
                 fontweight="bold" if name == bold else "normal", zorder=7)  # fmt: skip
        written.append((float(along[at]), float(mine[at])))
        inside.add(name)
    return inside


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
        return LEFT, 6

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
            above = all(curve[at] >= other[at] for other in others) or apart[at] > 0.1 * top
            words_at(axes, name, float(nm[at]), float(curve[at]), color=self.colors[name], ha="center",
                     fontweight="bold" if bold else "normal", va="bottom" if above else "top", zorder=5)  # fmt: skip
        for edge in self.edges:
            axes.axvline(edge, color=GAIN, linestyle=(0, (2, 2)), linewidth=1.2)
        for edge, side in zip(self.edges, ("right", "left") * len(self.edges), strict=False):
            axes.text(
                edge, 1.17 * top, f" {edge:.0f} nm ", ha=side, va="bottom", color=GAIN, fontsize=size, fontweight="bold"
            )
        axes.set_xlabel("wavelength / nm", fontsize=size, color=INK)


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
        return LEFT, 12

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
