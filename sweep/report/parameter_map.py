"""Map of the best objective over two parameters: what a filter would have to be."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from ..base.types import Array, Float, PerWavelength
from ..results.output import Output
from ..results.tables import NAMED
from .figures import Drawing, canvas
from .leaders import label, leaders_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_BAND = ("peak_nm", "fwhm_nm")
"""Parameters of a map of absorption bands."""
_AMOUNTS = ("absorbance", "mol_per_l", "percent_by_weight")
_BETWEEN = 101
"""Peaks, from one of the map to the next, among which the widest band is looked for."""
_MOST_NAMED = 3
_STYLES = ("-", "--", ":", "-.")


@dataclass(frozen=True)
class MapFigure:
    """Best objective over two parameters.

    `best`: best objective; NaN where no design is feasible; `points`: peak and width of the colorants of a catalog, nm.
    """

    title: str
    label: str
    names: tuple[str, str]
    x: Float[Array, " x"]
    y: Float[Array, " y"]
    best: Float[Array, "y x"]
    levels: Sequence[tuple[str, float]]
    points: Float[Array, "points 2"]


def map_figure(output: Output) -> MapFigure | None:
    """Return the map of a run's search.

    None without a map.
    """
    search = output.study.search
    if output.map is None or search is None or search.map is None:
        return None
    first, second = search.map
    cells = output.map.assign(objective=output.map["objective"].where(output.map["feasible"]))
    grid = cells.pivot(index=second, columns=first, values="objective")
    plain, goal = leaders_of(output).plain, output.goal.name
    named = output.kind(NAMED)
    named = named[(named["scenario"] == output.scenario) & named[goal].notna()].nlargest(_MOST_NAMED, goal)
    rows = [*([] if plain is None else [plain]), *named.to_dict("records")]
    is_band = (first, second) == _BAND
    points = [_peak_and_width(output.curves.wavelength_nm, curve) for curve in output.curves.colorants.values()]
    return MapFigure(
        f"{output.study.study}: best {output.goal.words}",
        output.goal.axis,
        (first, second),
        grid.columns.to_numpy(dtype=float),
        grid.index.to_numpy(dtype=float),
        grid.to_numpy(dtype=float),
        [(label(row), float(row[goal])) for row in rows],
        np.array(points if is_band else []).reshape(-1, 2),
    )


def _peak_and_width(wavelength_nm: PerWavelength, curve: PerWavelength) -> tuple[float, float]:
    """Return the peak of a curve and its width at half height, nm; NaN where it has no half height on a side."""
    peak, half = int(curve.argmax()), float(curve.max()) / 2
    sides = []
    for side in (slice(peak, None, -1), slice(peak, None)):
        nm, values = wavelength_nm[side], curve[side]
        below = np.flatnonzero(values < half)
        if not below.size:
            return float(wavelength_nm[peak]), np.nan
        at = slice(int(below[0]) - 1, int(below[0]) + 1)
        sides.append(float(np.interp(half, values[at][::-1], nm[at][::-1])))
    return float(wavelength_nm[peak]), sides[1] - sides[0]


def map_lines(output: Output) -> Iterator[str]:
    """Yield the widest absorption band, between the cells of a map, that reaches each other design."""
    figure = map_figure(output)
    if figure is None or figure.names != _BAND:
        return
    for name, level in figure.levels:
        separation = f"{output.goal.words} of {name} ({output.goal.formatted(level)})"
        widths_nm = np.array([_width_at(figure.y, objectives, level) for objectives in figure.best.T])
        if np.isnan(widths_nm).all():
            yield f"No band of the map has the {separation}."
            continue
        peak_nm, fwhm_nm = _widest(figure.x, widths_nm, figure.y[-1])
        band = _interpolated(_feasible(output), peak_nm, fwhm_nm)
        at_end = fwhm_nm == figure.y[-1]
        width = (
            f"{fwhm_nm:g} nm FWHM, the widest of the map" if at_end else f"{math.floor(fwhm_nm)} nm FWHM (rounded down)"
        )
        yield (
            f"The widest band that has the {separation} is of {width}, near {peak_nm:.0f} nm, with an absorbance of "
            f"{band['absorbance']:.2f}{_amount(band)}."
        )


def _width_at(widths_nm: Float[Array, " widths"], objectives: Float[Array, " widths"], level: float) -> float:
    """Return a width, between those of the map, up to which the objective reaches a level; NaN if there is none.

    Beyond the last width that reaches it, a convex or concave curve is above one of two lines: the one that goes on as
    before that width, and the chord to the next one. The steeper of both is taken.
    """
    reaching = np.flatnonzero(objectives >= level)
    if not reaching.size:
        return np.nan
    last = int(reaching[-1])
    around = slice(max(last - 1, 0), last + 2)
    slopes = np.diff(objectives[around]) / np.diff(widths_nm[around])
    if slopes.size < 2 or not slopes.min() < 0:  # at an end of the map, or of its feasible cells
        return float(widths_nm[last])
    return float(widths_nm[last] + (level - objectives[last]) / slopes.min())


def _widest(
    peaks_nm: Float[Array, " peaks"], widths_nm: Float[Array, " widths"], most_nm: float
) -> tuple[float, float]:
    """Return the peak with the largest width, and that width, between the peaks of the map.

    Between two peaks a curve whose third derivative keeps its sign lies between the parabolas through both and the
    peak before or after them. The lower one is taken.
    """
    at = int(np.nanargmax(widths_nm))
    widest = float(widths_nm[at]), float(peaks_nm[at])
    for first in range(peaks_nm.size - 3):
        if np.isnan(widths_nm[first : first + 4]).any():
            continue
        between_nm = np.linspace(peaks_nm[first + 1], peaks_nm[first + 2], _BETWEEN)
        parabolas = [
            np.polynomial.Polynomial.fit(peaks_nm[part], widths_nm[part], 2)(between_nm)
            for part in (slice(first, first + 3), slice(first + 1, first + 4))
        ]
        lower_nm = np.minimum(np.minimum(*parabolas), most_nm)
        at = int(lower_nm.argmax())
        widest = max(widest, (float(lower_nm[at]), float(between_nm[at])))
    fwhm_nm, peak_nm = widest
    return peak_nm, fwhm_nm


def _interpolated(cells: pd.DataFrame, peak_nm: float, fwhm_nm: float) -> dict[str, float]:
    """Return the numbers of a band between cells of the map."""
    band: dict[str, float] = {}
    for name in (name for name in _AMOUNTS if name in cells):
        grid = cells.pivot(index="fwhm_nm", columns="peak_nm", values=name)
        of_peaks = [np.interp(fwhm_nm, grid.index, grid[peak]) for peak in grid]
        band[name] = float(np.interp(peak_nm, grid.columns, of_peaks))
    return band


def _feasible(output: Output) -> pd.DataFrame:
    """Return the feasible cells of a run's map."""
    assert output.map is not None
    return output.map[output.map["feasible"]]


def _amount(band: Mapping[str, float]) -> str:
    """Return the concentration of a band, if it is known."""
    if "mol_per_l" not in band:
        return ""
    return f" ({band['mol_per_l']:.3f} mol/l, {band['percent_by_weight']:.1f} % by weight)"


def specification(output: Output) -> pd.DataFrame | None:
    """Return what an absorption band would have to be; None without a map of absorption bands.

    For each width the best peak, its absorbance (decadic, in a film of 0.8 um), objective and sensitivity, and, where
    an extinction is assumed, concentrations.
    """
    figure = map_figure(output)
    if figure is None or figure.names != _BAND:
        return None
    cells = _feasible(output)
    best = cells.loc[cells.groupby("fwhm_nm")["objective"].idxmax()].sort_values("fwhm_nm")
    names = ("fwhm_nm", "peak_nm", "absorbance", "objective", "sensitivity", "mol_per_l", "percent_by_weight")
    return best[[name for name in names if name in best]].rename(columns={"objective": output.goal.name})


def map_drawing(output: Output) -> Iterator[tuple[str, str, Drawing]]:
    """Yield the map, if there is one."""
    figure = map_figure(output)
    if figure is not None:
        lines = ", ".join(name for name, _ in figure.levels)
        dots = "; dots are the colorants of the catalog" if len(figure.points) else ""
        caption = f"Best {output.goal.words} over {figure.names[0]} and {figure.names[1]}; lines: as {lines}{dots}"
        yield "map", caption, partial(_draw, figure)


def _draw(figure: MapFigure) -> Figure:
    """Draw the map alone."""
    drawn, axes = canvas(8.0, 5.0)
    _draw_on(drawn, axes, figure)
    return drawn


def _draw_on(drawn: Figure, axes: Axes, figure: MapFigure) -> None:
    """Draw the objective in colors, and a line where it is that of another design."""
    colors = axes.pcolormesh(figure.x, figure.y, figure.best, shading="nearest", cmap="cividis", vmin=0.0)
    low, high = np.nanmin(figure.best), np.nanmax(figure.best)
    for (name, level), style in zip(figure.levels, _STYLES, strict=False):
        if low < level < high:
            axes.contour(figure.x, figure.y, figure.best, levels=[level], colors="white", linestyles=style)
            axes.plot([], [], color="#888888", linestyle=style, label=f"as {name} ({level:.0f})")
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    axes.plot(*figure.points.T, "o", color="white", markeredgecolor="black", markersize=4, linestyle="none")
    axes.set(xlim=(left, right), ylim=(bottom, top), title=figure.title)
    axes.set_xlabel(figure.names[0].replace("_nm", " / nm"))
    axes.set_ylabel(figure.names[1].replace("_nm", " / nm"))
    drawn.colorbar(colors, ax=axes, label=figure.label)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="upper right", fontsize=8)
