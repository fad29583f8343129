"""Maps of absorption bands: the widest band that reaches a design, and what a band would have to be."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from ...base.types import Array, Float
from ...results.output import Output
from . import MAP
from .section import axes_of

_BAND = ("peak_nm", "fwhm_nm")
"""Parameters of a map of absorption bands."""
_AMOUNTS = ("absorbance", "mol_per_l", "percent_by_weight")
_BETWEEN = 101
"""Peaks, from one of the map to the next, among which the widest band is looked for."""


def widest_bands(output: Output, levels: Mapping[str, float]) -> dict[str, dict[str, float]]:
    """Return the widest absorption band, between the cells of a map, that has as much as each of some designs.

    Returns none where the search has no such map. `levels`: name -> objective.
    """
    cells = output.tables.get(MAP)
    if cells is None or tuple(axes_of(output.study)) != _BAND:
        return {}
    feasible = cells[cells["feasible"]]
    grid = feasible.pivot(index="fwhm_nm", columns="peak_nm", values="objective")
    x, y = grid.columns.to_numpy(dtype=float), grid.index.to_numpy(dtype=float)
    found = {}
    for name, level in levels.items():
        widths_nm = np.array([_width_at(y, objectives, level) for objectives in grid.to_numpy(dtype=float).T])
        if np.isfinite(widths_nm).any():
            peak_nm, fwhm_nm = _widest(x, widths_nm, y[-1])
            place = {"wanted": level, "fwhm_nm": fwhm_nm, "peak_nm": peak_nm}
            found[name] = place | _interpolated(feasible, peak_nm, fwhm_nm)
    return found


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


def specification(output: Output) -> pd.DataFrame | None:
    """Return what an absorption band would have to be; None without a map of absorption bands.

    For each width the best peak, its absorbance (decadic, in a film of 0.8 um), objective and sensitivity, and, where
    an extinction is assumed, concentrations.
    """
    cells = output.tables.get(MAP)
    if cells is None or tuple(axes_of(output.study)) != _BAND:
        return None
    cells = cells[cells["feasible"]]
    best = cells.loc[cells.groupby("fwhm_nm")["objective"].idxmax()].sort_values("fwhm_nm")
    names = ("fwhm_nm", "peak_nm", "absorbance", "objective", "sensitivity", "mol_per_l", "percent_by_weight")
    return best[[name for name in names if name in best]].rename(columns={"objective": output.goal.name})
