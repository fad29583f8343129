"""Saturation in two steps: the full well holds no more electrons, then the ADC ends at its full scale."""

from __future__ import annotations

import numpy as np

from ...types import FloatArray
from ..pixel import Pixel
from ..view import Methods, Setup
from .quantization import rounded

METHODS = ("skip", "clip")
JUST_ABOVE = 1 + 1e-12
"""Bounds of a value that is rounded leave this room for the arithmetic of both."""


def skip_is_exact(_: Setup) -> str | None:
    """Nothing but the brightness decides."""
    return None


def top_e(pixel: Pixel) -> float:
    """Electrons from which the readout does not rise any more: the full well, or the end of the ADC's range."""
    return min(pixel.well_e, (pixel.full_scale_dn - pixel.offset_dn) / pixel.dn_per_e)


def clipped(electrons: FloatArray, pixel: Pixel) -> FloatArray:
    """Electrons as the readout sees them."""
    return np.minimum(electrons, top_e(pixel))


def promise(setup: Setup, brightest_e: float, methods: Methods) -> float:
    """Range of what leaving it out changes in one coordinate, DN: that of the brightest signal, which grows with it.

    Where the value is rounded afterwards, the change of the rounded one, which the end of the ADC still bounds; where
    noise dithers it, up to a step more. `methods`: those of the rest of the readout, which is switched before.
    """
    pixel = setup.pixel
    excess = max(0.0, brightest_e - top_e(pixel)) * pixel.dn_per_e
    if excess == 0 or methods.quantization == "skip":
        return excess
    if setup.scenario.noise is not None:
        return excess + 1.0
    held, whole = rounded(np.array([top_e(pixel), brightest_e * JUST_ABOVE]) * pixel.dn_per_e, pixel)
    return float(whole - held)
