"""Picture of a file of curves: over wavelength, and the chromaticity diagram of lights."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...base.types import PerValue
from ...report.figures import CURVE_CYCLE, TYPE_COLORS, panel_grid
from ...report.panels import CHANNELS
from ...spectra.color import REGIONS, display_colors
from ...spectra.facts import Curve, Facts
from ...spectra.signal_color import VISIBLE, LightColor, outline, spectral_locus

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MOST_NAMED = 16
_MOST_LETTERS = 32
_MOST_DRAWN = 200
_MOST_POINTS = 4000
_TICKS_NM = (460, 480, 490, 500, 510, 520, 540, 560, 580, 600, 620, 700)
_CORNER_X, _CORNER_Y = (0.53, 0.74), (0.25, 0.46)
_LABEL_WIDTH, _LABEL_HEIGHT = 0.2, 0.028
"""Names whose points are nearer than this, in x and y, stand one above the other."""
_MIDDLE_X = 0.33
_INSET = (0.49, 0.55, 0.35, 0.35)
Paint = tuple[float, ...] | str


def draw(title: str, facts: Facts, colors: Mapping[str, LightColor | None]) -> Figure:
    """Plot curves; of very many an even sample.

    `colors`: colors of lights; empty for QE.
    """
    lights = bool(colors)
    step = -(-len(facts.curves) // _MOST_DRAWN)
    if step > 1:
        title = f"{title}: {len(facts.curves[::step])} of {len(facts.curves):,} curves"
        facts = replace(facts, curves=facts.curves[::step])
        colors = {curve.name: colors[curve.name] for curve in facts.curves} if lights else {}
    figure, panels = panel_grid(1 + lights, 1 + lights, 13.0 if lights else 8.0, 5.0 if lights else 4.2)
    paints = {curve.name: _paint(curve, at, lights=lights) for at, curve in enumerate(facts.curves)}
    _draw_curves(panels[0], facts, paints)
    panels[0].set_title(title, parse_math=False)
    if lights:
        _draw_diagram(panels[1], colors, paints)
    return figure


def _short(name: str) -> str:
    return name if len(name) <= _MOST_LETTERS else f"{name[: _MOST_LETTERS - 3]}..."


def _paint(curve: Curve, at: int, *, lights: bool) -> Paint:
    """Return a light's color, or the usual one of a QE curve's name."""
    if lights and curve.on(VISIBLE).any():
        rgb = display_colors(VISIBLE, curve.on(VISIBLE)[None])[0]
        return tuple(0.85 * float(channel) for channel in rgb)  # darker, to be seen on white
    return CHANNELS.get(curve.name) or CURVE_CYCLE[at % len(CURVE_CYCLE)]


def _draw_curves(axes: Axes, facts: Facts, paints: Mapping[str, Paint]) -> None:
    named = len(facts.curves) <= _MOST_NAMED
    lines = []
    for curve in facts.curves:
        marker = "." if curve.values.size < 20 else None
        lines += axes.plot(*_thinned(curve), color=paints[curve.name], linewidth=1.6 if named else 0.7, marker=marker)
    axes.set(xlabel="wavelength / nm", ylabel="value in the file")
    if all(curve.values.min(initial=0.0) >= 0 for curve in facts.curves):
        axes.set_ylim(bottom=0)
    axes.axvspan(400, 700, color="#000000", alpha=0.04, linewidth=0)
    axes.text(402, 0.99, "400-700 nm", transform=axes.get_xaxis_transform(), va="top", fontsize=7, color="#777777")
    if named:
        names = [f" {_short(curve.name)}" for curve in facts.curves]  # a leading underscore would hide a name
        legend = axes.legend(
            lines, names, fontsize=8, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0, frameon=False
        )
        for text in legend.get_texts():
            text.set_parse_math(False)


def _thinned(curve: Curve) -> tuple[PerValue, PerValue]:
    """Return the samples to draw: of very many the smallest and the largest of each group, so that no peak is lost."""
    group = -(-2 * curve.values.size // _MOST_POINTS)
    if group <= 2:
        return curve.wavelength_nm, curve.values
    in_groups = curve.values.size // group * group
    groups = curve.values[:in_groups].reshape(-1, group)
    ends = np.stack([groups.argmin(axis=1), groups.argmax(axis=1)], axis=1)
    at = np.sort(ends, axis=1) + group * np.arange(len(groups))[:, None]
    shown = np.unique([*at.ravel(), *range(in_groups, curve.values.size)])
    return curve.wavelength_nm[shown], curve.values[shown]


def _draw_diagram(axes: Axes, colors: Mapping[str, LightColor | None], paints: Mapping[str, Paint]) -> None:
    """Draw CIE 1931 x, y with the regions of EN 12368 (and the orange between) and a point for each light.

    Yellow, orange and red crowd in one corner, which is drawn enlarged, too.
    """
    corner = axes.inset_axes(_INSET, transform=axes.transData)
    corner.set(xlim=_CORNER_X, ylim=_CORNER_Y, aspect="equal", xticks=[], yticks=[])
    points = {name: color.xy for name, color in colors.items() if color is not None}
    locus = spectral_locus()
    closed = np.vstack([locus, locus[:1]])
    for panel in (axes, corner):
        panel.plot(closed[:, 0], closed[:, 1], color="#555555", linewidth=1.0)
        for kind in REGIONS:
            polygon = outline(kind)
            panel.fill(polygon[:, 0], polygon[:, 1], color=TYPE_COLORS[kind], alpha=0.30, linewidth=0)
            panel.fill(polygon[:, 0], polygon[:, 1], fill=False, edgecolor=TYPE_COLORS[kind], linewidth=0.8)
        for name, xy in points.items():
            panel.plot(*xy, "o", color=paints[name], markeredgecolor="black", markeredgewidth=0.6, markersize=5)
    if len(points) <= _MOST_NAMED:
        _name_points(axes, corner, points)
    for tick in _TICKS_NM:
        x, y = locus[int(tick - VISIBLE.start_nm)]
        axes.plot(x, y, ".", color="#555555", markersize=4)
        if not _in_corner(x, y):
            axes.annotate(f"{tick}", (x, y), (5, 4), textcoords="offset points", fontsize=7, color="#555555")
    axes.indicate_inset_zoom(corner, edgecolor="#999999")
    axes.set(xlim=(-0.06, 0.86), ylim=(0, 0.9), aspect="equal", xlabel="CIE 1931 x", ylabel="y")
    axes.set_title("regions of EN 12368 (and orange between)")


def _name_points(axes: Axes, corner: Axes, points: Mapping[str, tuple[float, float]]) -> None:
    """Write names with lines to their points in the corner, and beside the points elsewhere, one above the other."""
    rank = 0
    taken: list[tuple[float, float]] = []
    for name, (x, y) in sorted(points.items(), key=lambda item: item[1][1]):
        if _in_corner(x, y):
            at, line = (0.02, 0.05 + 0.065 * rank), {"arrowstyle": "-", "color": "#999999", "linewidth": 0.5}
            text = corner.annotate(
                _short(name),
                (x, y),
                at,
                textcoords="axes fraction",
                fontsize=7,
                va="center",
                arrowprops=line,
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8},  # lines of lower names pass below it
            )
            rank += 1
        else:
            near = [v for u, v in taken if abs(u - x) < _LABEL_WIDTH and abs(v - y) < _LABEL_HEIGHT]
            height = max(near, default=y - _LABEL_HEIGHT) + _LABEL_HEIGHT
            taken.append((x, height))
            side, shift = ("left", 0.012) if x < _MIDDLE_X else ("right", -0.012)
            text = axes.annotate(_short(name), (x + shift, height), fontsize=7, ha=side, va="center", zorder=6)
        text.set_parse_math(False)


def _in_corner(x: float, y: float) -> bool:
    return bool(_CORNER_X[0] <= x <= _CORNER_X[1] and _CORNER_Y[0] <= y <= _CORNER_Y[1])
