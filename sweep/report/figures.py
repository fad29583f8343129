"""Figures in two steps: a figure's data as a plain value, then the drawing (matplotlib, PNG and SVG)."""

from __future__ import annotations

import io
import itertools
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ..types import FloatArray, IndexArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.patches import Rectangle

COLORS = {
    "infeasible": "#b8b8b8",
    "feasible": "#56b4e9",
    "front": "#0072b2",
    "best": "#d55e00",
    "named": "#000000",
    "reference": "#7a7a7a",
}
"""Okabe and Ito's palette, which the color-blind can tell apart; every group has a marker of its own, too."""
CURVE_COLORS = {
    "R": "#d62728",
    "Rx": "#8c2d04",
    "G": "#2ca02c",
    "B": "#1f77b4",
    "Y": "#c9a800",
    "Cy": "#17a2a2",
    "C": "#555555",
}
LINE_COLORS = {"front of the search": "#d55e00", "limit of any filter, unquantized": "#009e73"}
LINE_STEPS = {"front of the search": "steps-pre", "limit of any filter, unquantized": "steps-post"}
"""Between two levels of sensitivity holds what was found at the next one, and what was proven at the last one."""
TYPE_COLORS = {"green": "#009e73", "yellow": "#c9a800", "orange": "#e66100", "red": "#b2182b"}
CURVE_CYCLE = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
_LABEL_BOX = {"facecolor": "white", "alpha": 0.75, "edgecolor": "none", "pad": 1.0}
_DRAWN_POINTS = 10_000
_TICK = r"$\mathdefault"
"""How Matplotlib begins the numbers of a logarithmic axis."""


@dataclass(frozen=True)
class Points:
    """A named group of designs: x and y, each ndarray[n], and labels of single points (empty: none)."""

    x: FloatArray
    y: FloatArray
    labels: tuple[str, ...] = ()


@dataclass(frozen=True)
class ParetoFigure:
    """CSD against sensitivity. `levels` are CFAs without a modified channel: name -> CSD. `lines` are trade-offs."""

    title: str
    x_label: str
    y_label: str
    groups: Mapping[str, Points]
    lines: Mapping[str, Points]
    levels: Mapping[str, float]
    bound: float | None
    bound_text: str = ""


@dataclass(frozen=True)
class CurvesFigure:
    """Curves over wavelength: name -> ndarray[n_wavelengths], or ndarray[n, n_wavelengths] for a bundle of one name.

    `dashed` names those drawn dashed; `colors` overrides the usual colors.
    """

    title: str
    y_label: str
    wavelength_nm: FloatArray
    curves: Mapping[str, FloatArray]
    dashed: Sequence[str] = ()
    colors: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Cloud:
    """Signals of one design in the plane of two channels: signal type -> x and y, DN, each ndarray[n]."""

    title: str
    x_label: str
    y_label: str
    types: Mapping[str, tuple[FloatArray, FloatArray]]


@dataclass(frozen=True)
class ChartFigure:
    """The color checker chart: signal type -> sRGB colors of its patches, ndarray[n, 3]."""

    title: str
    patches: Mapping[str, FloatArray]


def thin(points: Points, most: int = _DRAWN_POINTS) -> Points:
    """At most `most` of the points, spread evenly and not in step with a grid; labeled points are all kept."""
    if points.labels or points.x.size <= most:
        return points
    kept = even(points.x.size, most)
    return Points(points.x[kept], points.y[kept])


def even(size: int, most: int) -> IndexArray:
    """At most `most` of `size` indices, in order, spread evenly and not in step with a grid."""
    if size <= most:
        return np.arange(size)
    golden = (np.arange(most) * ((5**0.5 - 1) / 2)) % 1
    return np.unique((golden * size).astype(np.intp))


def draw_pareto(figure: ParetoFigure) -> Figure:
    """Draw the trade-off; infeasible and feasible designs, front, optimum and named designs each have their marker."""
    figure_, axes = canvas(8.0, 5.0)
    styles: dict[str, dict[str, Any]] = {
        "infeasible": {"marker": "x", "s": 9, "alpha": 0.45, "linewidths": 0.6, "zorder": 1},
        "feasible": {"marker": "o", "s": 6, "alpha": 0.5, "linewidths": 0, "zorder": 2},
        "front": {"marker": "o", "s": 14, "zorder": 3},
        "best": {"marker": "*", "s": 220, "edgecolors": "black", "linewidths": 0.8, "zorder": 6},
        "named": {"marker": "D", "s": 42, "zorder": 5},
    }
    for group, points in figure.groups.items():
        if points.x.size:
            shown = thin(points)
            axes.scatter(
                shown.x,
                shown.y,
                color=COLORS[group],
                label=_group_label(group, points),
                rasterized=True,
                **styles[group],
            )
            for x, y, label in zip(points.x, points.y, points.labels, strict=False):
                axes.annotate(label, (x, y), textcoords="offset points", xytext=(7, 5), fontsize=9, zorder=7)
    for (name, points), style in zip(figure.lines.items(), itertools.cycle(("-", "--"))):
        drawn: Any = {"drawstyle": LINE_STEPS.get(name, "default"), "linewidth": 1.5, "zorder": 4}
        axes.plot(points.x, points.y, style, color=LINE_COLORS.get(name, "black"), label=name, **drawn)
    low, high = axes.get_xlim()
    heights = sorted(figure.levels.items(), key=lambda item: item[1])
    for _, level in heights:
        axes.axhline(level, color=COLORS["reference"], linestyle=":", linewidth=1.1, zorder=0)
    for text, level in _level_labels(heights, axes.get_ylim()):
        axes.text(low + 0.01 * (high - low), level, text, fontsize=8, va="bottom", zorder=8, bbox=_LABEL_BOX)
    if figure.bound is not None:
        axes.axvline(figure.bound, color="black", linestyle="--", linewidth=1.0, label=figure.bound_text)
    axes.set_xlim(low, high)
    axes.set_xlabel(figure.x_label)
    axes.set_ylabel(figure.y_label)
    axes.set_title(figure.title)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0, frameon=False)
    return figure_


def _group_label(group: str, points: Points) -> str:
    text = {
        "infeasible": "does not meet the constraints",
        "feasible": "feasible",
        "front": "Pareto front",
        "best": "best of the search",
        "named": "named designs",
    }[group]
    return f"{text} ({points.x.size:,})" if group in ("infeasible", "feasible", "front") else text


def _level_labels(heights: Sequence[tuple[str, float]], limits: tuple[float, float]) -> list[tuple[str, float]]:
    """One label for levels that lie too close for two."""
    merged: list[tuple[list[str], float]] = []
    for name, level in heights:
        if merged and level - merged[-1][1] < 0.03 * (limits[1] - limits[0]):
            merged[-1][0].append(f"{name} {level:.0f}")
        else:
            merged.append(([f"{name} {level:.0f}"], level))
    return [(", ".join(names), level) for names, level in merged]


def draw_curves(figure: CurvesFigure) -> Figure:
    """Draw curves over wavelength."""
    figure_, axes = canvas(8.0, 4.0)
    spare = iter(CURVE_CYCLE * (1 + len(figure.curves) // len(CURVE_CYCLE)))
    for name, values in figure.curves.items():
        color = figure.colors.get(name) or CURVE_COLORS.get(name) or next(spare)
        style = "--" if name in figure.dashed else "-"
        lines = values.reshape(-1, figure.wavelength_nm.size)
        width = 1.6 if len(lines) == 1 else 0.7
        labels = [name] + [None] * (len(lines) - 1)
        axes.plot(figure.wavelength_nm, lines.T, style, color=color, linewidth=width, label=labels)
    axes.set_xlabel("wavelength / nm")
    axes.set_ylabel(figure.y_label)
    axes.set_ylim(bottom=0)
    axes.margins(x=0)
    axes.set_title(figure.title)
    axes.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0, frameon=False)
    return figure_


def draw_clouds(rows: Sequence[Sequence[Cloud]], title: str, top_dn: float) -> Figure:
    """A row of panels per design, all with the same axes up to `top_dn`, so that distances compare by eye."""
    most = max(len(row) for row in rows)
    figure = _figure(3.1 * most + 1.0, 2.9 * len(rows) + 0.6)
    panels = figure.subplots(len(rows), most, squeeze=False)
    for line, row in zip(panels, rows, strict=True):
        for axes in line[len(row) :]:
            axes.set_axis_off()
        for axes, cloud in zip(line, row, strict=False):
            _decorate(axes)
            for (name, (x, y)), marker in zip(cloud.types.items(), itertools.cycle("osD^vP")):
                axes.scatter(x, y, s=13, marker=marker, color=TYPE_COLORS.get(name), label=name, linewidths=0)
            axes.set(xlim=(0, top_dn), ylim=(0, top_dn), aspect="equal", xlabel=cloud.x_label, ylabel=cloud.y_label)
            axes.set_title(cloud.title, fontsize=9)
    panels[0][0].legend(fontsize=7, frameon=False)
    figure.suptitle(title)
    return figure


def draw_chart(chart: ChartFigure) -> Figure:
    """Draw the patches, a row per signal type, and the gray reference steps."""
    figure = _figure(8.0, 0.55 * (len(chart.patches) + 1) + 0.8)
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


def canvas(width_in: float, height_in: float) -> tuple[Figure, Axes]:
    """An empty figure with one pair of axes, sizes in inches."""
    figure = _figure(width_in, height_in)
    axes = figure.add_subplot()
    _decorate(axes)
    return figure, axes


def canvas_grid(rows: int, columns: int, width_in: float, height_in: float) -> tuple[Figure, list[Axes]]:
    """An empty figure with a grid of axes, row by row, sizes in inches."""
    figure = _figure(width_in, height_in)
    panels = [figure.add_subplot(rows, columns, at + 1) for at in range(rows * columns)]
    for axes in panels:
        _decorate(axes)
    return figure, panels


def _figure(width_in: float, height_in: float) -> Figure:
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415  (slow to import)
    from matplotlib.figure import Figure  # noqa: PLC0415

    figure = Figure(figsize=(width_in, height_in), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _decorate(axes: Axes) -> None:
    axes.grid(visible=True, color="#e4e4e4", linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def rendered(figure: Figure, kind: str) -> bytes:
    """A drawn figure as the bytes of a `png` or `svg` file; the same figure gives the same bytes."""
    import matplotlib as mpl  # noqa: PLC0415
    from matplotlib.text import Text  # noqa: PLC0415

    for text in figure.findobj(Text):
        if "$" in text.get_text() and not text.get_text().startswith(_TICK):
            text.set_parse_math(False)  # a name, not a formula
    buffer = io.BytesIO()
    metadata = {"Date": None} if kind == "svg" else {"Software": None}
    with mpl.rc_context({"svg.hashsalt": "cfa-sweep", "svg.fonttype": "path"}), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph")  # a name in a script that the font lacks
        figure.savefig(buffer, format=kind, dpi=160, metadata=metadata)
    figure.set_layout_engine("none")  # found once, the layout holds for the other kind, too
    return buffer.getvalue()
