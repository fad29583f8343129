"""Surrogate of the AR0820's QE from stated parameters; not measured.

QE = clear pixel times filter transmission. The clear pixel is a monotone cubic through a few nodes; a filter is a
product of logistic edges (the shape of a dye filter's edge) between its leakage, another such cubic, and its peak.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from ...base.types import PerWavelength
from ..spectrum import Curves, WavelengthGrid
from .surrogate import LEAK_NODES_NM, ClearPixel, FilterParameters, SurrogateParameters

_LOGISTIC_PER_WIDTH = 2 * math.log(9)
"""A logistic rises from 0.1 to 0.9 within 2 ln 9 of its scale."""


def monotone(nodes_nm: ArrayLike, values: ArrayLike, wavelength_nm: PerWavelength) -> PerWavelength:
    """Return the monotone cubic through nodes: Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5, 300 (1984).

    That of `scipy.interpolate.PchipInterpolator`, whose import takes longer than reading the file.
    """
    x, y = np.asarray(nodes_nm, dtype=float), np.asarray(values, dtype=float)
    step = np.diff(x)
    rise = np.diff(y) / step
    slope = np.zeros_like(y)
    same = rise[:-1] * rise[1:] > 0  # where it turns, it is flat
    left, right = (2 * step[1:] + step[:-1])[same], (step[1:] + 2 * step[:-1])[same]
    mean = (left / rise[:-1][same] + right / rise[1:][same]) / (left + right)
    slope[1:-1][same] = 1 / mean
    slope[0] = _end_slope(step[0], step[1], rise[0], rise[1])
    slope[-1] = _end_slope(step[-1], step[-2], rise[-1], rise[-2])
    bend = (slope[:-1] + slope[1:] - 2 * rise) / step
    at = np.clip(np.searchsorted(x, wavelength_nm, side="right") - 1, 0, step.size - 1)
    s = wavelength_nm - x[at]
    second = (rise - slope[:-1]) / step - bend
    return np.asarray(y[at] + slope[at] * s + second[at] * (s * s) + (bend / step)[at] * (s * s * s), dtype=float)


def _end_slope(step: float, next_step: float, rise: float, next_rise: float) -> float:
    """Return the slope at an end: that of the parabola through three nodes, limited for monotonicity."""
    slope = ((2 * step + next_step) * rise - step * next_rise) / (step + next_step)
    if slope * rise <= 0:
        return 0.0
    return 3 * rise if rise * next_rise < 0 and abs(slope) > 3 * abs(rise) else slope


def clear_qe(wavelength_nm: PerWavelength, clear: ClearPixel) -> PerWavelength:
    """Return the QE of the clear pixel."""
    return monotone(clear.wavelength_nm, clear.qe, wavelength_nm)


def transmission(wavelength_nm: PerWavelength, parameters: FilterParameters) -> PerWavelength:
    """Return the transmission of a color filter, between its leak and its peak."""
    opened = np.ones_like(wavelength_nm)
    for edge in parameters.edges:
        sign = 1 if edge.passes == "above" else -1
        offset = sign * (wavelength_nm - edge.center_nm) / edge.width_nm
        opened = opened * _logistic(offset)
    leak = monotone(LEAK_NODES_NM, parameters.leak, wavelength_nm)
    return leak + (parameters.peak - leak) * opened


def _logistic(offset_widths: PerWavelength) -> PerWavelength:
    """Return a logistic edge over the offset from its center in units of its 10-90 % width."""
    return np.asarray(1 / (1 + np.exp(-_LOGISTIC_PER_WIDTH * offset_widths)), dtype=float)


def ir_cut_transmission(wavelength_nm: PerWavelength, parameters: SurrogateParameters) -> PerWavelength:
    """Return the transmission of the IR cut."""
    return _logistic((parameters.ir_cut.center_nm - wavelength_nm) / parameters.ir_cut.width_nm)


def ar0820(grid: WavelengthGrid, parameters: SurrogateParameters) -> Curves:
    """Return the surrogate sensor: C and every filter of the parameter file.

    `grid`: wavelengths inside 400 to 700 nm.
    """
    wave = grid.nodes_nm
    clear = clear_qe(wave, parameters.clear_pixel) * ir_cut_transmission(wave, parameters)
    values = {"C": clear} | {name: clear * transmission(wave, f) for name, f in parameters.filters.items()}
    return Curves(wave, values, "built-in surrogate ar0820", surrogate=True)
