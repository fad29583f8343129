"""Saturation in two steps: the full well holds no more electrons, then the ADC ends at its full scale."""

from __future__ import annotations

import numpy as np

from ..arrays import FloatArray
from ..sensor import Pixel
from ..setup import Setup

METHODS = ("skip", "clip")


def skip_is_exact(_: Setup) -> str | None:
    """Nothing but the brightness decides."""
    return None


def top_e(pixel: Pixel) -> float:
    """Electrons from which the readout does not rise any more: the full well, or the end of the ADC's range."""
    return min(pixel.well_e, (pixel.full_scale_dn - pixel.offset_dn) / pixel.dn_per_e)


def clipped(electrons: FloatArray, pixel: Pixel) -> FloatArray:
    """Electrons as the readout sees them."""
    return np.minimum(electrons, top_e(pixel))


def promise(setup: Setup, brightest_e: float) -> float:
    """Range of what leaving it out changes in one coordinate, DN: the excess of the brightest signal."""
    return max(0.0, brightest_e - top_e(setup.pixel)) * setup.pixel.dn_per_e
