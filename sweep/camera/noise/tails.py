"""Closed-form bounds on the effect of noise at the bright end.

Chernoff's bound on a pixel's electrons Y = N + read noise, N Poisson with a mean of `electrons` times a Gaussian gain:
E exp(t Y) <= exp(m a + (m a p)^2 / 2 + (t r)^2 / 2), a = exp(t) - 1, with mean m, PRNU p and read noise r, for t > 0.
A gain below 0 gives no electrons, which adds its share: it is at least ten deviations off. Every t gives a bound, so a
grid of them suffices.
"""

from __future__ import annotations

import math

import numpy as np

from ...base.types import Array, Float
from ..pixel import Pixel

_BELOW_ZERO = 1e-23
"""Share of gains below 0 at most, with the largest PRNU."""
_EXPONENTS = np.geomspace(1e-7, 4.0, 256)


def share_above(level_e: float, electrons: float, pixel: Pixel, read_noise_e: float) -> float:
    """Return an upper bound on the share of readouts above a level, 0 to 1."""
    return min(1.0, float(np.exp(_exponents(level_e, electrons, pixel, read_noise_e)).min()))


def mean_above(level_e: float, electrons: float, pixel: Pixel, read_noise_e: float) -> float:
    """Return an upper bound on the mean of max(0, Y - level); x is at most exp(t x - 1) / t."""
    return float((np.exp(_exponents(level_e, electrons, pixel, read_noise_e) - 1) / _EXPONENTS).min())


def _exponents(level_e: float, electrons: float, pixel: Pixel, read_noise_e: float) -> Float[Array, " exponents"]:
    """Return the exponent of the bound for every t of the grid."""
    more = electrons * np.expm1(_EXPONENTS)
    log_mean = np.logaddexp(more + (more * pixel.prnu) ** 2 / 2, math.log(_BELOW_ZERO))
    return np.asarray(np.minimum(log_mean + (_EXPONENTS * read_noise_e) ** 2 / 2 - _EXPONENTS * level_e, 700.0))
