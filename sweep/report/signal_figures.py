"""Figures of the signals: point clouds in the channels of a CFA, and the color checker chart."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..base.types import FloatArray
from .figures import TYPE_COLORS, decorate, empty_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.patches import Rectangle


@dataclass(frozen=True)
class Cloud:
    """Signals of one design in the plane of two channels: signal type -> x and y, DN, each ndarray[n].

    `nearest`: x and y of the two signals that limit the separation, ndarray[2] each, and their distance in words.
    """

    title: str
    x_label: str
    y_label: str
    types: Mapping[str, tuple[FloatArray, FloatArray]]
    nearest: tuple[FloatArray, FloatArray, str] | None = None


@dataclass(frozen=True)
class ChartFigure:
    """The color checker chart: signal type -> sRGB colors of its patches, ndarray[n, 3]."""

    title: str
    patches: Mapping[str, FloatArray]


def draw_clouds(rows: Sequence[Sequence[Cloud]], title: str, top_dn: float) -> Figure:
    """A row of panels per design, all with the same axes up to `top_dn`, so that distances compare by eye."""
    most = max(len(row) for row in rows)
    figure = empty_figure(3.1 * most + 1.0, 2.9 * len(rows) + 0.6)
    panels = figure.subplots(len(rows), most, squeeze=False)
    for line, row in zip(panels, rows, strict=True):
        for axes in line[len(row) :]:
            axes.set_axis_off()
        for axes, cloud in zip(line, row, strict=False):
            decorate(axes)
            for (name, (x, y)), marker in zip(cloud.types.items(), itertools.cycle("osD^vP")):
                axes.scatter(x, y, s=13, marker=marker, color=TYPE_COLORS.get(name), label=name, linewidths=0)
            if cloud.nearest is not None:
                x, y, text = cloud.nearest
                axes.plot(x, y, "-", color="black", linewidth=1.2, label=text)
                axes.annotate(text, (x.mean(), y.mean()), (6, -10), textcoords="offset points", fontsize=7)
            axes.set(xlim=(0, top_dn), ylim=(0, top_dn), aspect="equal", xlabel=cloud.x_label, ylabel=cloud.y_label)
            axes.set_title(cloud.title, fontsize=9)
    panels[0][0].legend(fontsize=7, frameon=False, loc="upper right")
    figure.suptitle(title)
    return figure


def draw_chart(chart: ChartFigure) -> Figure:
    """Draw the patches, a row per signal type, and the gray reference steps."""
    figure = empty_figure(8.0, 0.55 * (len(chart.patches) + 1) + 0.8)
    axes = figure.add_subplot()
    steps = np.linspace(1.0, 0.1, 6)
    rows = [*chart.patches.items(), ("gray reference", np.repeat(steps[:, None], 3, axis=1))]
    for height, (_, colors) in enumerate(rows):
        for place, color in enumerate(colors):
            axes.add_patch(_rectangle(place, -height, color))
    axes.set_xlim(-0.1, max(len(colors) for _, colors in rows))
    axes.set_ylim(-len(rows) + 0.9, 1.0)
    axes.set_yticks([0.45 - height for height in range(len(rows))], [name for name, _ in rows])
    axes.set_xticks([])
    axes.set_aspect("equal")
    for side in axes.spines.values():
        side.set_visible(False)
    axes.set_title(chart.title)
    return figure


def _rectangle(x: float, y: float, color: FloatArray) -> Rectangle:
    from matplotlib.patches import Rectangle  # noqa: PLC0415  (slow to import)

    return Rectangle((x, y), 0.9, 0.9, facecolor=tuple(color))
