"""LEDs of a fixed shape whose peak moves: how deep a red, or how red a yellow, may become."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from ...base.types import Array, Float, PerWavelength
from ...spectra.builtin.data_sets.tl16 import red_led
from ...spectra.spectrum import WavelengthGrid, equal_photons

GAUSS_FWHM_NM = 18.0
FIRST_NM = 630.0
"""Peak from which reds move, both ways."""
Shape = Callable[[PerWavelength, float], PerWavelength]
"""Photon spectrum of an LED at a peak, nm."""


def red_shapes() -> dict[str, Shape]:
    """Return shapes of red LEDs: those of the lamps of `tl16`, modeled, and a Gaussian of 18 nm FWHM."""

    def gauss(wavelength_nm: PerWavelength, peak_nm: float) -> PerWavelength:
        return np.asarray(np.exp(-4 * np.log(2) * ((wavelength_nm - peak_nm) / GAUSS_FWHM_NM) ** 2))

    return {
        "German": partial(red_led, "germany"),
        "US": partial(red_led, "us"),
        f"Gaussian, {GAUSS_FWHM_NM:g} nm": gauss,
    }


def moved(shape: Shape, peaks_nm: Float[Array, " peaks"], grid: WavelengthGrid) -> Float[Array, "peaks wavelengths"]:
    """Return photon spectra at some peaks that integrate to 1 on the grid."""
    return equal_photons(grid, np.stack([shape(grid.nodes_nm, float(peak)) for peak in peaks_nm]))
