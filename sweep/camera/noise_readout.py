"""What a noisy readout gives for errors: mean and variance, and where its noise may be taken as Gaussian."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.types import BoolArray, FloatArray
from .noise import table
from .pixel import Pixel

_DITHERED_DN = 0.7
_MANY_STEPS = 16.0


@dataclass(frozen=True)
class NoisyReadout:
    """Mean (DN) and variance (DN^2) of each channel, ndarray[n_designs, n_cases, n_signals, n_channels].

    `gaussian`: where its noise may be taken as Gaussian. No pixel is cut by full well or an end of the ADC, and read
    noise dithers each pixel (0.7 DN), or the deviation is at least 4 steps of the pixel that weighs most. In random
    pixels and pairs the error of Gaussians was then never less than 1 / 1.2 of the exact one, down to 1e-12
    (`tests/test_confusion.py`): evidence, not a proof. `reach_dn`: no pixel moves the channel further from its mean,
    but for 1e-15. `exposure_s`: ndarray[n_designs].
    """

    mean: FloatArray
    variance: FloatArray
    gaussian: BoolArray
    reach_dn: FloatArray
    exposure_s: FloatArray


def is_cut(electrons: FloatArray, pixel: Pixel) -> FloatArray:
    """1 where the full well or an end of the ADC cuts a pixel's noise, else 0; of expected electrons of any shape."""
    low, high = table.unclipped_e(pixel)
    return ((electrons < low) | (electrons > high)).astype(float)


def is_gaussian(variance: FloatArray, heaviest: FloatArray, cut: BoolArray, pixel: Pixel) -> BoolArray:
    """`NoisyReadout.gaussian`: `heaviest` is the largest weight of a pixel, `cut` where any pixel is."""
    dithered = pixel.dn_per_e * pixel.read_noise_e >= _DITHERED_DN
    return np.asarray(~cut & (dithered | (variance >= _MANY_STEPS * heaviest**2)), dtype=bool)


def reach_dn(electrons: FloatArray, pixel: Pixel) -> FloatArray:
    """How far a pixel's number is from its mean at most, but for 1e-15, DN: of the brightest of the last axis, kept."""
    reach_e = 9 * (np.sqrt(electrons) + pixel.prnu * electrons + pixel.read_noise_e) + 27
    found = np.minimum(pixel.dn_per_e * reach_e + 1, float(pixel.full_scale_dn))
    return np.asarray(found.max(axis=-1, keepdims=True), dtype=float)
