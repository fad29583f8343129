"""The pedestal: an offset that the readout adds. It cancels in a distance, unless something clips or is rounded.

Without noise a pixel reads y(o) = min(floor(v + o + 1/2), F), with pedestal o, full scale F and v the electrons that
the full well left, in DN. F is whole, so the end of the ADC's range may be taken before or after rounding. Leaving the
pedestal out changes a value by c = y(o) - y(0). What all values share cancels in a difference, so c counts with its
range; so it does for a channel that is the mean of several pixels.

- Where nothing clips, c = floor(v + o + 1/2) - floor(v + 1/2). For a whole pedestal that is o, whatever v is: rounding
  half up commutes with whole numbers. A pedestal with a fraction shifts the steps, and c is floor(o) or ceil(o).
- At the ADC's end y(o) stays while y(0) still rises, so that c falls, to F - y(0) of the brightest signal.
- Read noise s before rounding dithers, whatever the number of electrons: the mean of c differs from o by at most
  h = 2 sum over k of |sin(pi k o)| exp(-2 (pi k s)^2) / (pi k), the Fourier series of the mean rounding error at two
  places that are o apart.
- Noise is cut at both ends. The tails that a pedestal keeps above zero, and those that it moves beyond F, change the
  mean by at most their first moments. Rounding makes the lower one no larger: the mean of what is cut from the rounded
  value is the sum of the tail's probabilities at half steps below zero, the midpoint rule of the moment, and that tail
  is convex. The upper one it makes at most that of an end half a step before.
"""

from __future__ import annotations

import math

import numpy as np

from ..pixel import Pixel
from ..shot import Shot
from .base import Chosen, ReadoutEffect
from .saturation import JUST_ABOVE

_MOST_E = 1e30
"""More electrons than this are as many as this."""
_TERMS = 50
_LEAST_SIGMA_DN = 0.05
"""With less noise the series is not summed: its terms fall too slowly."""


def _dithered_steps(pixel: Pixel) -> float:
    """Range of the mean of c where the noise of a dark pixel dithers the steps: 2 h, and at most a step, DN."""
    if pixel.offset_dn == math.floor(pixel.offset_dn):
        return 0.0
    sigma = pixel.dn_per_e * pixel.read_noise_e
    if sigma < _LEAST_SIGMA_DN:
        return 1.0
    k = np.arange(1, _TERMS)
    terms = np.abs(np.sin(math.pi * k * pixel.offset_dn)) * np.exp(-2 * (math.pi * k * sigma) ** 2) / (math.pi * k)
    return min(1.0, float(4 * terms.sum()))


def _most_cut(mean: float, sigma: float, end: float) -> float:
    """The mean of max(0, x - end) is at most this, for x of any distribution with this mean and sigma (Scarf, 1958)."""
    far = end - mean
    whole = math.hypot(sigma, far)
    return sigma**2 / (2 * (whole + far)) if far > 0 else (whole - far) / 2


def _tails(pixel: Pixel, brightest_dn: float, *, rounds: bool) -> tuple[float, float]:
    """What the ADC's ends cut from the mean: without the pedestal at the bottom, and with it at the top, DN.

    At the bottom the bound has no maximum between the darkest and the brightest signal: with variance
    n + (prnu n)^2 + read^2 of n electrons its derivative changes sign at most once, from falling to rising.
    """
    gain, read_e = pixel.dn_per_e, pixel.read_noise_e
    brightest_e = min(brightest_dn / gain, _MOST_E)
    spread_e = math.hypot(math.sqrt(brightest_e), pixel.prnu * brightest_e, read_e)
    bottom = max(_most_cut(0.0, read_e, 0.0), _most_cut(-brightest_e, spread_e, 0.0))
    end_e = (pixel.full_scale_dn - pixel.offset_dn - 0.5 * rounds) / gain
    top = min(_most_cut(brightest_e, spread_e, end_e), _most_cut(pixel.well_e, read_e, end_e))
    return gain * bottom, gain * top


class Pedestal(ReadoutEffect):
    """The offset that a dark pixel reads."""

    name = "pedestal"
    methods = ("skip", "add")
    order = 3
    without = "cancels in every difference"

    def exact(self, shot: Shot) -> str | None:
        """There may be none."""
        return "no pedestal" if shot.pixel.offset_dn == 0 else None

    def range_dn(self, shot: Shot, brightest_dn: float, methods: Chosen) -> float:
        """See `ReadoutEffect`, and the head of this file."""
        pixel, noisy = shot.pixel, shot.scenario.noise is not None
        offset, full = pixel.offset_dn, pixel.full_scale_dn
        rounds, clips = methods.quantization == "round", methods.saturation == "clip"
        held_dn = min(brightest_dn, pixel.well_e * pixel.dn_per_e) if clips else brightest_dn
        if rounds and not noisy:
            shortest = full - math.floor(min(held_dn * JUST_ABOVE, full) + 0.5)
            return float(math.ceil(offset) - min(math.floor(offset), shortest))
        found = _dithered_steps(pixel) if rounds else 0.0
        bottom, top = _tails(pixel, brightest_dn, rounds=rounds)
        if noisy and clips and methods.noise == "expected":
            return min(found + bottom + top, float(math.ceil(offset)) if rounds else offset)
        if rounds:  # the shift by rounding knows the ends, with the pedestal and without
            found += bottom + min(1.0, 2 * top)
        return found + (min(offset, max(0.0, min(held_dn, full) + offset - full)) if clips else 0.0)
