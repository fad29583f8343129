"""A surrogate of the AR0820's quantum efficiencies, made from stated parameters; not measured.

QE = clear pixel x filter transmission. The clear pixel is a monotone cubic through a few nodes; a filter is a product
of logistic edges (the shape of a dye filter's edge) between its leakage, which is such a cubic, too, and its peak.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from ...base.types import FloatArray
from ..spectrum import Curves, WavelengthGrid
from .surrogate import LEAK_NODES_NM, ClearPixel, FilterParameters, SurrogateParameters

_LOGISTIC_PER_WIDTH = 2 * math.log(9)
"""A logistic rises from 0.1 to 0.9 within 2 ln 9 of its scale."""


def _monotone(nodes_nm: ArrayLike, values: ArrayLike, wavelength_nm: FloatArray) -> FloatArray:
    """The monotone cubic through some nodes."""
    from scipy.interpolate import PchipInterpolator  # noqa: PLC0415  (slow to import: kept off the start-up path)

    return np.asarray(PchipInterpolator(nodes_nm, values)(wavelength_nm), dtype=float)


def clear_qe(wavelength_nm: FloatArray, clear: ClearPixel) -> FloatArray:
    """QE of the unfiltered pixel, ndarray[n_wavelengths]."""
    return _monotone(clear.wavelength_nm, clear.qe, wavelength_nm)


def transmission(wavelength_nm: FloatArray, parameters: FilterParameters) -> FloatArray:
    """Transmission of a color filter, ndarray[n_wavelengths], between its leak and its peak."""
    opened = np.ones_like(wavelength_nm)
    for edge in parameters.edges:
        sign = 1 if edge.passes == "above" else -1
        offset = sign * (wavelength_nm - edge.center_nm) / edge.width_nm
        opened = opened * _logistic(offset)
    leak = _monotone(LEAK_NODES_NM, parameters.leak, wavelength_nm)
    return leak + (parameters.peak - leak) * opened


def _logistic(offset_widths: FloatArray) -> FloatArray:
    """A logistic edge over the offset from its center in units of its 10-90 % width."""
    return np.asarray(1 / (1 + np.exp(-_LOGISTIC_PER_WIDTH * offset_widths)), dtype=float)


def ar0820(grid: WavelengthGrid, parameters: SurrogateParameters) -> Curves:
    """The surrogate sensor on a grid inside 400-700 nm: C and every filter of the parameter file."""
    wave = grid.nodes_nm
    clear = clear_qe(wave, parameters.clear_pixel) * _logistic(
        (parameters.ir_cut.center_nm - wave) / parameters.ir_cut.width_nm
    )
    values = {"C": clear} | {name: clear * transmission(wave, f) for name, f in parameters.filters.items()}
    return Curves(wave, values, "built-in surrogate ar0820", surrogate=True)
