"""Maps of absorption bands: the widest band that reaches a design, and what a band would have to be."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from ..base.types import Array, Float
from ..results.output import Output
from ..results.tables import NAMED
from .leaders import label, leaders_of

_BAND = ("peak_nm", "fwhm_nm")
"""Parameters of a map of absorption bands."""
_AMOUNTS = ("absorbance", "mol_per_l", "percent_by_weight")
_BETWEEN = 101
"""Peaks, from one of the map to the next, among which the widest band is looked for."""
_MOST_NAMED = 3


@dataclass(frozen=True)
class BandMap:
    """Best objective over two parameters.

    `best`: best objective; NaN where no design is feasible.
    """

    names: tuple[str, str]
    x: Float[Array, " x"]
    y: Float[Array, " y"]
    best: Float[Array, "y x"]
    levels: Sequence[tuple[str, float]]


def band_map(output: Output) -> BandMap | None:
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
    return BandMap(
        (first, second),
        grid.columns.to_numpy(dtype=float),
        grid.index.to_numpy(dtype=float),
        grid.to_numpy(dtype=float),
        [(label(row), float(row[goal])) for row in rows],
    )


def map_lines(output: Output) -> Iterator[str]:
    """Yield the widest absorption band, between the cells of a map, that reaches each other design."""
    figure = band_map(output)
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
    figure = band_map(output)
    if figure is None or figure.names != _BAND:
        return None
    cells = _feasible(output)
    best = cells.loc[cells.groupby("fwhm_nm")["objective"].idxmax()].sort_values("fwhm_nm")
    names = ("fwhm_nm", "peak_nm", "absorbance", "objective", "sensitivity", "mol_per_l", "percent_by_weight")
    return best[[name for name in names if name in best]].rename(columns={"objective": output.goal.name})
