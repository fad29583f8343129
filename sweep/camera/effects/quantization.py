"""Rounding to digital numbers; under noise, its mean effect."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from ...base.types import FloatArray
from ..noisy import gaussian, moments, tails
from ..pixel import Pixel
from ..shot import Shot
from .base import NEXT_TO_NOTHING_DN, Chosen, Load, ReadoutEffect

ROUNDED_S = 1.2e-9
"""Seconds of rounding a value; `tests/bench_work.py` measures them."""
_CURVATURE = 4 * math.e
"""Second derivative of a Poisson mean in the root of the electrons, at most, for values between -1 and 1.

The mean at s + iy is at most exp(2 y^2), since a Poisson probability there grows by |exp(|z| - z)|, z = (s + iy)^2; on
a circle of radius 1 / sqrt(2) Cauchy's estimate of the derivative is 2 e / (1 / 2).
"""


def rounded(dn: FloatArray, pixel: Pixel) -> FloatArray:
    """The pedestal added to `dn`, rounded half up, inside the ADC's range.

    The whole part of the pedestal is added after rounding, so that no digit of a float is lost to it: values with and
    without a whole pedestal differ by exactly that.
    """
    whole = math.floor(pixel.offset_dn)
    steps = np.asarray(dn + (pixel.offset_dn - whole), dtype=float)
    steps += 0.5
    np.floor(steps, out=steps)
    steps += whole
    return np.clip(steps, 0.0, pixel.full_scale_dn, out=steps)


def steepness(pixel: Pixel) -> float:
    """Largest slope of the mean rounded value under noise, relative to that of the readout before it."""
    return 1 + under_noise(pixel, math.inf)[1]


@lru_cache(maxsize=64)
def under_noise(pixel: Pixel, brightest_e: float) -> tuple[float, float]:
    """Range of the shift by rounding, DN, over the numbers of electrons; its largest slope, DN per DN.

    Shifts at a table's nodes, with what they may miss in between; from the last counted electron on those of a
    Gaussian. The slope of a Poisson mean is the mean of the steps from count to count. PRNU averages over both.
    """
    from ..compiled import poisson_means  # noqa: PLC0415  (compiled: kept off the start-up path)

    even, most_e = moments.without_prnu(pixel), brightest_e * (1 + moments.DRAWN * pixel.prnu)
    electrons = moments.table_nodes(even) ** 2
    electrons = electrons[: 1 + int(np.searchsorted(electrons, most_e))]
    gain, low, high, steepest = even.dn_per_e, 0.0, 0.0, 0.0
    for run, first, each in moments.runs(electrons, even):
        shift = each[moments.ROUNDED] - each[moments.UNROUNDED]
        slope = np.append(np.diff(shift), 0.0) / gain
        found = poisson_means(electrons[run], first, np.stack([shift, slope]))
        missed = _CURVATURE * np.diff(np.sqrt(electrons[run])).max(initial=moments.STEP) ** 2 / 8
        low = min(low, found[0].min() - missed * np.abs(shift).max())
        high = max(high, found[0].max() + missed * np.abs(shift).max())
        steepest = max(steepest, np.abs(found[1]).max() + missed * np.abs(slope).max())
    sigma = gain * math.hypot(math.sqrt(moments.COUNTED_E), even.read_noise_e)
    if electrons[-1] > moments.COUNTED_E and sigma < gaussian.SMOOTH_DN:
        terms = [math.exp(-2 * (math.pi * k * sigma) ** 2) for k in range(1, 2 + math.ceil(3 / sigma))]
        most = min(0.5, sum(term / (math.pi * k) for k, term in enumerate(terms, 1)))
        low, high, steepest = min(low, -most), max(high, most), max(steepest, 2 * sum(terms))
    return float(high - low), float(steepest)


def smoothed(pixel: Pixel, brightest_e: float) -> float:
    """Range of the shift by rounding under noise at most, DN, in closed form.

    Read noise takes the shift's harmonics down: the k-th of 1 / (pi k) to exp(-2 (pi k sigma)^2) of that, whatever the
    electrons are. Where the ADC's range ends, half a DN is missing at most in the readouts beyond.
    """
    sigma = pixel.dn_per_e * pixel.read_noise_e
    if sigma == 0:
        return 1.0
    first = math.exp(-2 * (math.pi * sigma) ** 2)
    below = float(gaussian.share_below(np.array(-pixel.offset_dn / sigma)))
    above_e = (pixel.full_scale_dn - pixel.offset_dn) / pixel.dn_per_e
    beyond = below + tails.share_above(above_e, brightest_e, pixel, pixel.read_noise_e)
    return min(1.0, 2 * (first / (math.pi * (1 - first)) + beyond / 2))


class Quantization(ReadoutEffect):
    """Whole digital numbers."""

    name = "quantization"
    methods = ("skip", "round")
    order = 1
    bends = True

    def exact(self, shot: Shot) -> str | None:
        """Rounding always changes something."""
        return None

    def range_dn(self, shot: Shot, brightest_dn: float, methods: Chosen) -> float:
        """See `ReadoutEffect`: 1 at most; under noise the range of the mean's shift."""
        if shot.scenario.noise is None:
            return 1.0
        brightest_e = brightest_dn / shot.pixel.dn_per_e
        found_dn = smoothed(shot.pixel, brightest_e)
        return found_dn if found_dn <= NEXT_TO_NOTHING_DN else min(1.0, under_noise(shot.pixel, brightest_e)[0])

    def work(self, shot: Shot, methods: Chosen, load: Load) -> Load:
        """Every value is rounded."""
        return load if methods.quantization == "skip" else load._replace(value_s=load.value_s + ROUNDED_S)
