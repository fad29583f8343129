"""Figures in two steps: a figure's data as a plain value, then the drawing (matplotlib, PNG and SVG)."""

from __future__ import annotations

import io
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from ..base.types import FloatArray
from ..results.thinning import even

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Text

COLORS = {
    "infeasible": "#b8b8b8",
    "feasible": "#56b4e9",
    "front": "#0072b2",
    "best": "#d55e00",
    "named": "#000000",
    "reference": "#7a7a7a",
    "limit": "#009e73",
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
    "W": "#999999",
}
TRACED_NAME, BOUND_FILTER_NAME = "found by the search", "filter at the upper bound"
"""Legend entries: optima of the search at levels of sensitivity; the curve of the filter that attains its bound."""
TYPE_COLORS = {"green": "#009e73", "yellow": "#c9a800", "orange": "#e66100", "red": "#b2182b"}
CURVE_CYCLE = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
_LABEL_BOX = {"facecolor": "white", "alpha": 0.75, "edgecolor": "none", "pad": 1.0}
_DRAWN_POINTS = 10_000
_DPI = 160
_PACKED = 3
"""How hard zlib tries on a PNG: at its usual 6 a file is a tenth smaller and takes twice as long."""
Drawing = Callable[[], "Figure"]
"""A drawing that is put off: a process that draws nothing need not load what draws."""


@dataclass(frozen=True)
class Points:
    """A named group of designs: x and y, each ndarray[n], and labels of single points (empty: none)."""

    x: FloatArray
    y: FloatArray
    labels: tuple[str, ...] = ()


@dataclass(frozen=True)
class ParetoFigure:
    """CSD against the sensitivity of the modified channel.

    `levels`: CFAs without a modified channel, name -> CSD. `traced`: what the search found at each level of
    sensitivity; `limit`: the upper bound there, `limit_name`: which filters it bounds. `counts`: of the groups, in the
    whole table.
    """

    title: str
    x_label: str
    y_label: str
    groups: Mapping[str, Points]
    traced: Points | None
    limit: Points | None
    levels: Mapping[str, float]
    bound: float | None
    bound_text: str = ""
    limit_name: str = ""
    counts: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class CurvesFigure:
    """Curves over wavelength: name -> ndarray[n_wavelengths], or ndarray[n, n_wavelengths] for a bundle of one name.

    `dashed` names those drawn dashed; `colors` overrides the usual colors. `shades`: spectra of lights with a peak of 1
    by signal type, which stand behind the curves.
    """

    title: str
    y_label: str
    wavelength_nm: FloatArray
    curves: Mapping[str, FloatArray]
    dashed: Sequence[str] = ()
    colors: Mapping[str, str] = field(default_factory=dict)
    shades: Mapping[str, FloatArray] = field(default_factory=dict)


def thin(points: Points, most: int = _DRAWN_POINTS) -> Points:
    """At most `most` of the points, spread evenly and not in step with a grid; labeled points are all kept."""
    if points.labels or points.x.size <= most:
        return points
    kept = even(points.x.size, most)
    return Points(points.x[kept], points.y[kept])


def draw_pareto(figure: ParetoFigure) -> Figure:
    """Draw the trade-off; infeasible and feasible designs, front, best and named designs each have their marker."""
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
                label=_group_label(figure, group),
                rasterized=True,
                **styles[group],
            )
            for x, y, label in zip(points.x, points.y, points.labels, strict=False):
                axes.annotate(label, (x, y), textcoords="offset points", xytext=(7, 5), fontsize=9, zorder=7)
    if figure.traced is not None:
        axes.plot(
            figure.traced.x, figure.traced.y, "+", color=COLORS["best"], markersize=8, label=TRACED_NAME, zorder=4
        )
    if figure.limit is not None:
        style: dict[str, Any] = {"color": COLORS["limit"], "linestyle": "--", "linewidth": 1.5, "zorder": 4}
        axes.plot(figure.limit.x, figure.limit.y, label=figure.limit_name, drawstyle="steps-post", **style)
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


def _group_label(figure: ParetoFigure, group: str) -> str:
    text = {
        "infeasible": "does not meet the constraints",
        "feasible": "feasible",
        "front": "Pareto front",
        "best": "best of the search",
        "named": "named designs",
    }[group]
    return f"{text} ({figure.counts[group]:,})" if group in figure.counts else text


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
    top = max((float(values.max(initial=0.0)) for values in figure.curves.values()), default=1.0)
    for name, shade in figure.shades.items():
        axes.fill_between(
            figure.wavelength_nm, top * shade, color=TYPE_COLORS.get(name, "#777777"), alpha=0.12, linewidth=0
        )
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


def canvas(width_in: float, height_in: float) -> tuple[Figure, Axes]:
    """An empty figure with one pair of axes, sizes in inches."""
    figure = empty_figure(width_in, height_in)
    axes = figure.add_subplot()
    decorate(axes)
    return figure, axes


def canvas_grid(rows: int, columns: int, width_in: float, height_in: float) -> tuple[Figure, list[Axes]]:
    """An empty figure with a grid of axes, row by row, sizes in inches."""
    figure = empty_figure(width_in, height_in)
    panels = [figure.add_subplot(rows, columns, at + 1) for at in range(rows * columns)]
    for axes in panels:
        decorate(axes)
    return figure, panels


def empty_figure(width_in: float, height_in: float) -> Figure:
    """A figure without axes, sizes in inches."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415  (slow to import)
    from matplotlib.figure import Figure  # noqa: PLC0415

    figure = Figure(figsize=(width_in, height_in), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def decorate(axes: Axes) -> None:
    """The grid and the open frame of every figure."""
    axes.grid(visible=True, color="#e4e4e4", linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def pictures_of(draw: Drawing, kinds: Sequence[str]) -> dict[str, bytes]:
    """What `draw` draws as files of some kinds: kind -> what the file holds."""
    import matplotlib as mpl  # noqa: PLC0415  (slow to import)

    # Nothing stands above any axes: where a title goes need not be found out, which takes a sixth of a picture's time.
    with mpl.rc_context({"axes.titley": 1.0}):
        figure = draw()
    return {kind: rendered(figure, kind) for kind in kinds}


def _words(artist: Artist) -> Iterator[Text]:
    """Texts of a figure but the numbers along its axes: to look at these makes ticks that nothing else needs."""
    from matplotlib.axis import Axis  # noqa: PLC0415  (slow to import)
    from matplotlib.text import Text  # noqa: PLC0415
    from matplotlib.ticker import LogFormatter, ScalarFormatter  # noqa: PLC0415

    if isinstance(artist, Text):
        yield artist
    if isinstance(artist, Axis) and isinstance(artist.get_major_formatter(), LogFormatter | ScalarFormatter):
        yield artist.label
    else:
        for inner in artist.get_children():
            yield from _words(inner)


def rendered(figure: Figure, kind: str) -> bytes:
    """A drawn figure as the bytes of a `png` or `svg` file; the same figure gives the same bytes."""
    import matplotlib as mpl  # noqa: PLC0415
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415
    from matplotlib.backends.backend_svg import FigureCanvasSVG  # noqa: PLC0415
    from matplotlib.layout_engine import ConstrainedLayoutEngine  # noqa: PLC0415

    if isinstance(figure.get_layout_engine(), ConstrainedLayoutEngine):  # the first kind of this figure
        for text in _words(figure):
            text.set_parse_math(False)  # a name, not a formula
    buffer = io.BytesIO()
    with mpl.rc_context({"svg.hashsalt": "cfa-sweep", "svg.fonttype": "path"}), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph")  # a name in a script that the font lacks
        figure.set_dpi(_DPI)
        # The canvas' own functions: `savefig` would draw every figure twice.
        if kind == "svg":
            FigureCanvasSVG(figure).print_svg(buffer, metadata={"Date": None})  # type: ignore[no-untyped-call]
        else:
            packed = {"compress_level": _PACKED}
            FigureCanvasAgg(figure).print_png(buffer, metadata={"Software": None}, pil_kwargs=packed)  # type: ignore[no-untyped-call]
    figure.set_layout_engine("none")  # found once, the layout holds for the other kind, too
    return buffer.getvalue()
