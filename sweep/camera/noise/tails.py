"""What noise may do at the bright end at most, in closed form: for all that it takes no sums over counts.

Chernoff's bound of a pixel's electrons Y = N + read noise, N Poisson with a mean of `electrons` times a Gaussian gain:
E exp(t Y) <= exp(m a + (m a p)^2 / 2 + (t r)^2 / 2), a = exp(t) - 1, with mean m, PRNU p and read noise r, for t > 0. A
gain below 0 gives no electrons, which adds its share: it lies ten deviations off or further. Every t gives a bound, so
that a grid of them will do.
"""

from __future__ import annotations

import math

import numpy as np

from ...base.types import FloatArray
from ..pixel import Pixel

_BELOW_ZERO = 1e-23
"""Share of gains below 0 at most, with the largest PRNU."""
_EXPONENTS = np.geomspace(1e-7, 4.0, 256)


def share_above(level_e: float, electrons: float, pixel: Pixel, read_noise_e: float) -> float:
    """Share of readouts of a pixel above a level at most; `electrons`: what the pixel expects."""
    return min(1.0, float(np.exp(_exponents(level_e, electrons, pixel, read_noise_e)).min()))


def mean_above(level_e: float, electrons: float, pixel: Pixel, read_noise_e: float) -> float:
    """Mean of max(0, Y - `level_e`) at most, electrons: x is at most exp(t x - 1) / t."""
    return float((np.exp(_exponents(level_e, electrons, pixel, read_noise_e) - 1) / _EXPONENTS).min())


def _exponents(level_e: float, electrons: float, pixel: Pixel, read_noise_e: float) -> FloatArray:
    """Of the bound for every t of the grid, as far as a float goes."""
    more = electrons * np.expm1(_EXPONENTS)
    log_mean = np.logaddexp(more + (more * pixel.prnu) ** 2 / 2, math.log(_BELOW_ZERO))
    return np.asarray(np.minimum(log_mean + (_EXPONENTS * read_noise_e) ** 2 / 2 - _EXPONENTS * level_e, 700.0))
