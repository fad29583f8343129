"""The fronts of several runs in one picture."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ...base.types import FloatArray
from ..figures import CURVE_CYCLE, canvas, rendered

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MARKERS = "osD^vPX<>hp"
_DASHES = ("-", (0, (6, 2)), (0, (1, 1.5)), (0, (6, 2, 1, 2)))
_MARKS_PER_LINE = 12


@dataclass(frozen=True)
class FrontLine:
    """A front: its run's place among the runs, x and y, ndarray[n] each; `traced` ones get hollow marks."""

    name: str
    run: int
    x: FloatArray
    y: FloatArray
    traced: bool


@dataclass(frozen=True)
class Mark:
    """The best design of a run."""

    name: str
    run: int
    x: float
    y: float


@dataclass(frozen=True)
class FrontsFigure:
    """Separation over sensitivity of several runs."""

    title: str
    x_label: str
    y_label: str
    lines: Sequence[FrontLine]
    best: Sequence[Mark]


def draw_fronts(figure: FrontsFigure) -> Figure:
    """Draw the fronts: a color and a dash per run, a mark per front, so that they differ in gray, too.

    Of designs the front is a staircase: between two of them there is none. What the search found are points at its
    levels of sensitivity: between these nothing is known of it.
    """
    drawn, axes = canvas(9.0, 5.0)
    for line, marker in zip(figure.lines, itertools.cycle(_MARKERS)):
        color = CURVE_CYCLE[line.run % len(CURVE_CYCLE)]
        axes.plot(
            line.x,
            line.y,
            color=color,
            linestyle="none" if line.traced else _DASHES[line.run % len(_DASHES)],
            linewidth=1.4,
            marker=marker,
            markersize=6,
            markerfacecolor="white" if line.traced else color,
            markevery=1 if line.traced else _some_of(len(line.x)),
            drawstyle="steps-pre",
            label=line.name,
        )
    for mark in figure.best:
        color = CURVE_CYCLE[mark.run % len(CURVE_CYCLE)]
        style: dict[str, Any] = {"s": 220, "edgecolors": "black", "linewidths": 0.8, "zorder": 6}
        axes.scatter([mark.x], [mark.y], marker="*", color=color, **style)
        axes.annotate(mark.name, (mark.x, mark.y), textcoords="offset points", xytext=(8, 6), fontsize=9, zorder=7)
    axes.set_xlabel(figure.x_label)
    axes.set_ylabel(figure.y_label)
    axes.set_title(figure.title)
    if figure.lines:
        title = "stars: best design of each run"
        place: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (1.01, 1.0), "borderaxespad": 0}
        axes.legend(fontsize=8, frameon=False, title=title, title_fontsize=8, **place)
    return drawn


def _some_of(n: int) -> list[int]:
    """Points of a long line that are marked."""
    return [int(at) for at in np.unique(np.linspace(0, n - 1, _MARKS_PER_LINE).round())]


def pictures(figure: FrontsFigure) -> dict[str, bytes]:
    """The drawing as the bytes of a `png` and an `svg` file."""
    drawn = draw_fronts(figure)
    return {kind: rendered(drawn, kind) for kind in ("png", "svg")}
