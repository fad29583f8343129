"""Figures in two steps: a figure's data as a plain value, then the drawing (matplotlib, PNG and SVG)."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .arrays import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

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
_CYCLE = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
_LABEL_BOX = {"facecolor": "white", "alpha": 0.75, "edgecolor": "none", "pad": 1.0}
_DRAWN_POINTS = 10_000


@dataclass(frozen=True)
class Points:
    """A named group of designs: x and y, each ndarray[n], and labels of single points (empty: none)."""

    x: FloatArray
    y: FloatArray
    labels: tuple[str, ...] = ()


@dataclass(frozen=True)
class ParetoFigure:
    """CSD against sensitivity. `levels` are CFAs without a modified channel: name -> CSD."""

    title: str
    x_label: str
    y_label: str
    groups: Mapping[str, Points]
    levels: Mapping[str, float]
    bound: float | None
    bound_text: str = ""


@dataclass(frozen=True)
class CurvesFigure:
    """Curves over wavelength; `curves` maps a name to ndarray[n_wavelengths], `dashed` names those drawn dashed."""

    title: str
    y_label: str
    wavelength_nm: FloatArray
    curves: Mapping[str, FloatArray]
    dashed: Sequence[str] = ()


def thin(points: Points, most: int = _DRAWN_POINTS) -> Points:
    """At most `most` of the points, spread evenly and not in step with a grid; labeled points are all kept."""
    if points.labels or points.x.size <= most:
        return points
    golden = (np.arange(most) * ((5**0.5 - 1) / 2)) % 1
    kept = np.unique((golden * points.x.size).astype(np.intp))
    return Points(points.x[kept], points.y[kept])


def draw_pareto(figure: ParetoFigure) -> Figure:
    """Draw the trade-off; infeasible and feasible designs, front, optimum and named designs each have their marker."""
    canvas, axes = _canvas(8.0, 5.0)
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
    axes.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0, frameon=False)
    return canvas


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
    canvas, axes = _canvas(8.0, 4.0)
    spare = iter(_CYCLE * (1 + len(figure.curves) // len(_CYCLE)))
    for name, values in figure.curves.items():
        color = CURVE_COLORS.get(name) or next(spare)
        style = "--" if name in figure.dashed else "-"
        axes.plot(figure.wavelength_nm, values, style, color=color, label=name, linewidth=1.6)
    axes.set_xlabel("wavelength / nm")
    axes.set_ylabel(figure.y_label)
    axes.set_ylim(bottom=0)
    axes.margins(x=0)
    axes.set_title(figure.title)
    axes.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0, frameon=False)
    return canvas


def _canvas(width_in: float, height_in: float) -> tuple[Figure, Axes]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415  (slow to import)
    from matplotlib.figure import Figure  # noqa: PLC0415

    figure = Figure(figsize=(width_in, height_in), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.grid(visible=True, color="#e4e4e4", linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    return figure, axes


def rendered(figure: Figure, kind: str) -> bytes:
    """A drawn figure as the bytes of a `png` or `svg` file; the same figure gives the same bytes."""
    import matplotlib as mpl  # noqa: PLC0415

    buffer = io.BytesIO()
    metadata = {"Date": None} if kind == "svg" else {"Software": None}
    with mpl.rc_context({"svg.hashsalt": "cfa-sweep", "svg.fonttype": "path"}):
        figure.savefig(buffer, format=kind, dpi=160, metadata=metadata)
    return buffer.getvalue()
