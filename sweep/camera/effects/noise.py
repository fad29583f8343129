"""Photon, read and dark noise and PRNU: what they change in a mean, and Monte Carlo draws.

The CSD is the distance of mean values. Noise moves a mean only where the readout is not straight: at the full well, at
the ends of the ADC and at the steps of its quantization. Mean and variance are exact sums (`moments`).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ...base.types import FloatArray
from ..noisy import gaussian, moments, tails
from ..pixel import Pixel
from ..shot import Shot
from . import quantization
from .base import NEXT_TO_NOTHING_DN, Chosen, Load, ReadoutEffect
from .saturation import top_e

LOOKED_UP_S, TABLE_S = 5e-9, 0.017
"""Seconds of looking a value up in the table of noise, and of making the table; `tests/bench_work.py` measures them."""
_MOST_POISSON_E = 1e18
"""NumPy's Poisson generator takes no larger mean."""


def draws_dn(electrons: FloatArray, pixel: Pixel, rng: np.random.Generator) -> FloatArray:
    """Monte Carlo: a readout of each pixel, which expects `electrons` and has its own gain error; rounded."""
    # In place: to give memory to an array of millions of pixels takes as long as a sum over them.
    expected = rng.standard_normal(electrons.shape)
    expected *= pixel.prnu
    expected += 1
    expected *= electrons
    held = rng.poisson(np.clip(expected, 0.0, _MOST_POISSON_E, out=expected))
    dn = rng.standard_normal(out=expected)
    dn *= pixel.read_noise_e
    dn += np.minimum(held, pixel.well_e)
    dn *= pixel.dn_per_e
    dn += pixel.offset_dn
    dn += 0.5
    return np.clip(np.floor(dn, out=dn), 0, pixel.full_scale_dn, out=dn)


@lru_cache(maxsize=1024)
def range_of_pixel(pixel: Pixel, brightest_dn: float) -> float:
    """See `NoisyMean.range_dn`; scenes of one exposure share it."""
    at_most = _range_at_most(pixel, brightest_dn)
    if at_most <= NEXT_TO_NOTHING_DN:
        return at_most
    at_e, added = min(brightest_dn / pixel.dn_per_e, top_e(pixel)), _added_dn(pixel)
    mean = moments.moments(np.array([at_e]), pixel)[moments.UNROUNDED, 0]
    lost = pixel.dn_per_e * at_e + pixel.offset_dn - mean
    return min(float(added + max(lost + added, 0.0)), float(pixel.full_scale_dn))


def in_closed_form(pixel: Pixel, brightest_dn: float) -> bool:
    """Whether noise, and rounding under noise, change next to nothing, as closed forms tell."""
    rounding_dn = quantization.smoothed(pixel, brightest_dn / pixel.dn_per_e)
    return max(rounding_dn, _range_at_most(pixel, brightest_dn)) <= NEXT_TO_NOTHING_DN


def _range_at_most(pixel: Pixel, brightest_dn: float) -> float:
    """`range_of_pixel` at most, in closed form."""
    gain = pixel.dn_per_e
    at_e, end_e = min(brightest_dn / gain, top_e(pixel)), (pixel.full_scale_dn - pixel.offset_dn) / gain
    lost_e = tails.mean_above(pixel.well_e, at_e, pixel, 0.0) + tails.mean_above(end_e, at_e, pixel, pixel.read_noise_e)
    return 2 * _added_dn(pixel) + gain * lost_e


def _added_dn(pixel: Pixel) -> float:
    """What the dark end of the ADC's range adds to a mean at most."""
    read_dn = pixel.dn_per_e * pixel.read_noise_e
    return read_dn * float(gaussian.ramp(np.array(-pixel.offset_dn / read_dn))) if read_dn else 0.0


class NoisyMean(ReadoutEffect):
    """The mean of noisy readouts in place of the readout of the mean."""

    name = "noise"
    methods = ("skip", "expected")
    order = 0
    without = "moves no mean where nothing clips"

    def exact(self, shot: Shot) -> str | None:
        """A scene says whether there is noise."""
        return None if shot.scenario.noise is not None else "no noise asked for"

    def range_dn(self, shot: Shot, brightest_dn: float, methods: Chosen) -> float:
        """See `ReadoutEffect`.

        The mean is that of the hard readout, less what the full well and the bright end take, plus what the dark end
        adds. The dark end adds most in the dark. The others' loss grows with the signal up to the first of them, since
        no electron more is worth more than the gain, and falls beyond, where the hard readout stands still. So both
        extremes are single numbers.
        """
        return range_of_pixel(shot.pixel, brightest_dn)

    def work(self, shot: Shot, methods: Chosen, load: Load) -> Load:
        """What clips or rounds is looked up in a table, which costs more."""
        if shot.scenario.noise is None or not load.value_s or (methods.noise == methods.quantization == "skip"):
            return load
        return load._replace(shared_s=load.shared_s + TABLE_S, value_s=LOOKED_UP_S)
