"""The picture of a file of curves: over wavelength, and the chromaticity diagram of lights."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..base.types import FloatArray
from ..curves.color import REGIONS, display_colors
from ..curves.facts import Curve, Facts
from ..curves.signal_color import VISIBLE, LightColor, outline, spectral_locus
from ..report.figures import CURVE_COLORS, CURVE_CYCLE, TYPE_COLORS, canvas_grid

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
    """Draw the curves, an even share of very many; `colors` are those of lights, empty for QE."""
    lights = bool(colors)
    every = -(-len(facts.curves) // _MOST_DRAWN)
    if every > 1:
        title = f"{title}: {len(facts.curves[::every])} of {len(facts.curves):,} curves"
        facts = replace(facts, curves=facts.curves[::every])
        colors = {curve.name: colors[curve.name] for curve in facts.curves} if lights else {}
    figure, panels = canvas_grid(1, 2 if lights else 1, 13.0 if lights else 8.0, 5.0 if lights else 4.2)
    paints = {curve.name: _paint(curve, at, lights=lights) for at, curve in enumerate(facts.curves)}
    _draw_curves(panels[0], facts, paints)
    panels[0].set_title(title, parse_math=False)
    if lights:
        _draw_diagram(panels[1], colors, paints)
    return figure


def _short(name: str) -> str:
    return name if len(name) <= _MOST_LETTERS else f"{name[: _MOST_LETTERS - 3]}..."


def _paint(curve: Curve, at: int, *, lights: bool) -> Paint:
    """A light's own color; of a QE curve the usual one of its name."""
    if lights and curve.on(VISIBLE).any():
        rgb = display_colors(VISIBLE, curve.on(VISIBLE)[None])[0]
        return tuple(0.85 * float(channel) for channel in rgb)  # darker, to be seen on white
    return CURVE_COLORS.get(curve.name) or CURVE_CYCLE[at % len(CURVE_CYCLE)]


def _draw_curves(axes: Axes, facts: Facts, paints: Mapping[str, Paint]) -> None:
    width = 1.6 if len(facts.curves) <= _MOST_NAMED else 0.7
    drawn = [
        axes.plot(
            *_thinned(curve),
            color=paints[curve.name],
            linewidth=width,
            marker="." if curve.values.size < 20 else None,
        )[0]
        for curve in facts.curves
    ]
    axes.set_xlabel("wavelength / nm")
    axes.set_ylabel("value in the file")
    lowest = min((float(curve.values.min(initial=0.0)) for curve in facts.curves), default=0.0)
    if lowest >= 0:
        axes.set_ylim(bottom=0)
    axes.axvspan(400, 700, color="#000000", alpha=0.04, linewidth=0)
    axes.text(402, 0.99, "400-700 nm", transform=axes.get_xaxis_transform(), va="top", fontsize=7, color="#777777")
    if len(facts.curves) <= _MOST_NAMED:
        # A leading underscore would hide a name.
        names = [f" {_short(curve.name)}" for curve in facts.curves]
        legend = axes.legend(
            drawn, names, fontsize=8, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0, frameon=False
        )
        for text in legend.get_texts():
            text.set_parse_math(False)


def _thinned(curve: Curve) -> tuple[FloatArray, FloatArray]:
    """Samples to draw: of very many the smallest and the largest of each group, so that no peak is lost."""
    group = -(-2 * curve.values.size // _MOST_POINTS)
    if group <= 2:
        return curve.wavelength_nm, curve.values
    whole = curve.values.size // group * group
    groups = curve.values[:whole].reshape(-1, group)
    ends = np.stack([groups.argmin(axis=1), groups.argmax(axis=1)], axis=1)
    at = np.sort(ends, axis=1) + group * np.arange(len(groups))[:, None]
    kept = np.unique([*at.ravel(), *range(whole, curve.values.size)])
    return curve.wavelength_nm[kept], curve.values[kept]


def _draw_diagram(axes: Axes, colors: Mapping[str, LightColor | None], paints: Mapping[str, Paint]) -> None:
    """CIE 1931 x, y with the regions of EN 12368 (and the orange between) and a point for each light.

    Yellow, orange and red crowd in one corner, which is drawn enlarged, too.
    """
    corner = axes.inset_axes(_INSET, transform=axes.transData)
    corner.set(xlim=_CORNER_X, ylim=_CORNER_Y, aspect="equal")
    corner.set(xticks=[], yticks=[])
    named = {name: color for name, color in colors.items() if color is not None}
    for panel in (axes, corner):
        _draw_regions(panel)
        for name, color in named.items():
            panel.plot(*color.xy, "o", color=paints[name], markeredgecolor="black", markeredgewidth=0.6, markersize=5)
    if len(named) <= _MOST_NAMED:
        inside = {name: color.xy for name, color in named.items() if _in_corner(*color.xy)}
        for rank, name in enumerate(sorted(inside, key=lambda name: inside[name][1])):
            _in_corner_of(corner, name, inside[name], (0.02, 0.05 + 0.065 * rank))
        others = sorted(named.keys() - inside.keys(), key=lambda name: named[name].xy[1])
        taken: list[tuple[float, float]] = []
        for name in others:
            x, y = named[name].xy
            near = [at for u, at in taken if abs(u - x) < _LABEL_WIDTH and abs(at - y) < _LABEL_HEIGHT]
            taken.append((x, max(near, default=y - _LABEL_HEIGHT) + _LABEL_HEIGHT))
            _beside(axes, name, named[name].xy, taken[-1][1])
    for tick in _TICKS_NM:
        x, y = spectral_locus()[int(tick - VISIBLE.start_nm)]
        axes.plot(x, y, ".", color="#555555", markersize=4)
        if not _in_corner(x, y):
            axes.annotate(f"{tick}", (x, y), (5, 4), textcoords="offset points", fontsize=7, color="#555555")
    axes.indicate_inset_zoom(corner, edgecolor="#999999")
    axes.set(xlim=(-0.06, 0.86), ylim=(0, 0.9), aspect="equal", xlabel="CIE 1931 x", ylabel="y")
    axes.set_title("regions of EN 12368 (and orange between)")


def _draw_regions(axes: Axes) -> None:
    locus = spectral_locus()
    closed = np.vstack([locus, locus[:1]])
    axes.plot(closed[:, 0], closed[:, 1], color="#555555", linewidth=1.0)
    for kind in REGIONS:
        polygon = outline(kind)
        axes.fill(polygon[:, 0], polygon[:, 1], color=TYPE_COLORS[kind], alpha=0.30, linewidth=0)
        axes.fill(polygon[:, 0], polygon[:, 1], fill=False, edgecolor=TYPE_COLORS[kind], linewidth=0.8)


def _in_corner(x: float, y: float) -> bool:
    return _CORNER_X[0] <= x <= _CORNER_X[1] and _CORNER_Y[0] <= y <= _CORNER_Y[1]


def _beside(axes: Axes, name: str, xy: tuple[float, float], height: float) -> None:
    """Write a light's name beside its point, on the side where the diagram has room, at a height of the diagram."""
    right = xy[0] < _MIDDLE_X
    at = (xy[0] + (0.012 if right else -0.012), height)
    side = "left" if right else "right"
    axes.annotate(_short(name), at, fontsize=7, ha=side, va="center", parse_math=False, zorder=6)


def _in_corner_of(axes: Axes, name: str, xy: tuple[float, float], place: tuple[float, float]) -> None:
    """Write a light's name at a place of the panel (0..1), with a line to its point."""
    line = {"arrowstyle": "-", "color": "#999999", "linewidth": 0.5}
    text = axes.annotate(_short(name), xy, place, textcoords="axes fraction", fontsize=7, va="center", arrowprops=line)
    text.set_parse_math(False)
