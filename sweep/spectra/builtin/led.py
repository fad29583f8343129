"""Spectrum of an LED."""

from __future__ import annotations

import numpy as np

from ...base.types import PerWavelength


def led_photons(wavelength_nm: PerWavelength, peak_nm: float, blue_nm: float, red_nm: float) -> PerWavelength:
    """Return the photon spectrum of an LED, 1 at its peak.

    (a + b) / (a exp(-u/a) + b exp(u/b)), u = l - peak, a blue, b red: an asymmetric hyperbolic secant, which decays as
    exp(u/a) toward the blue and exp(-u/b) toward the red, as the band-edge emission of LEDs does.

    `peak_nm`, `blue_nm`, `red_nm`: peak, and decay lengths, nm.
    """
    u = wavelength_nm - peak_nm
    # exp(-|u|/scale) never overflows; the two sides are the same formula divided by its larger exponential.
    below = (blue_nm + red_nm) * np.exp(np.minimum(u, 0) / blue_nm)
    below /= blue_nm + red_nm * np.exp(np.minimum(u, 0) * (1 / red_nm + 1 / blue_nm))
    above = (blue_nm + red_nm) * np.exp(-np.maximum(u, 0) / red_nm)
    above /= red_nm + blue_nm * np.exp(-np.maximum(u, 0) * (1 / red_nm + 1 / blue_nm))
    return np.where(u < 0, below, above)
