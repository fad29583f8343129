"""Mean and variance of a pixel's digital number: Poisson electrons, full well, read noise, pedestal, ADC, rounding.

Exact sums over the numbers of electrons wherever the readout is nonlinear: near the dark end, the full well and the
ends of the ADC, and below 2^20 electrons wherever read noise does not dither the steps of rounding. Elsewhere the
readout is linear, and from 2^20 electrons on the steps are dithered by a Gaussian.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from ...base.types import Array, Bool, BoolArray, Float, PerValue
from ..pixel import Pixel
from . import gaussian

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

UNROUNDED, ROUNDED, VARIANCE = range(3)
"""Rows of what `moments` gives: mean before rounding and after (DN), variance after (DN^2)."""
COUNTED_E = 2.0**20
"""Up to here electrons are counted one by one wherever rounding shows."""
STEP = 1 / 64
"""Distance of nodes in the root of the electrons, in which Poisson means are smooth at a scale of 1."""
_REACH = 9.5
DRAWN = 8.5
"""Standard deviations of the gain beyond which it is left out: less than 1e-16."""
_PER_DEVIATION = 1.3
_FAR_ROOT = 16.0


def linear_moments(electrons: PerValue, pixel: Pixel) -> Float[Array, "3 values"]:
    """Return the moments of a linear readout whose Gaussian noise dithers the steps."""
    mean = pixel.dn_per_e * electrons + pixel.offset_dn
    sigma = pixel.dn_per_e * np.sqrt(electrons + (pixel.prnu * electrons) ** 2 + pixel.read_noise_e**2)
    shift, variance = gaussian.rounding(mean, sigma)
    return np.stack([mean, mean + shift, variance])


def of_count(electrons: PerValue, pixel: Pixel) -> Float[Array, "3 values"]:
    """Return the moments for a given number of electrons, without photon noise."""
    top, sigma = float(pixel.full_scale_dn), pixel.dn_per_e * pixel.read_noise_e
    mean = pixel.dn_per_e * np.minimum(electrons, pixel.well_e) + pixel.offset_dn
    return np.stack(
        [gaussian.clipped_gaussian(mean, sigma, 0.0, top)[0], *gaussian.clipped_and_rounded(mean, sigma, top)]
    )


@dataclass(frozen=True)
class LinearRange:
    """Electrons at which a pixel's readout stops to be linear.

    `low_e`: below, the dark end of the ADC has an effect; `full_e`: above, the readout is constant.
    """

    low_e: float
    high_e: float
    full_e: float
    last_e: float

    @classmethod
    def of(cls, pixel: Pixel) -> LinearRange:
        """Return the ends of a pixel."""
        reach_e = _REACH * pixel.read_noise_e
        adc_e = (pixel.full_scale_dn - pixel.offset_dn) / pixel.dn_per_e
        full_e = min(pixel.well_e, adc_e + reach_e)
        last_e = _least_exceeding(full_e) / (1 - DRAWN * pixel.prnu)
        return cls(reach_e - pixel.offset_dn / pixel.dn_per_e, min(pixel.well_e, adc_e - reach_e), full_e, last_e)


def _least_exceeding(electrons: float) -> float:
    """Return an expected number of electrons whose count is larger with a probability of 1 - 1e-19."""
    return ((_REACH + math.sqrt(_REACH**2 + 4 * max(electrons, 0.0))) / 2) ** 2


def _felt(electrons: PerValue, pixel: Pixel) -> Bool[BoolArray, " values"]:
    """Return where counts of Poisson electrons reach an end or show steps of rounding."""
    ends = LinearRange.of(pixel)
    sigma = _REACH * np.sqrt(electrons)
    nonlinear = (electrons - sigma < ends.low_e) | (electrons + sigma + _REACH**2 > ends.high_e)
    if pixel.dn_per_e * pixel.read_noise_e < gaussian.SMOOTH_DN:
        nonlinear |= electrons <= COUNTED_E
    return np.asarray(nonlinear, dtype=bool)


def without_prnu(pixel: Pixel) -> Pixel:
    """Return the pixel with equal gains."""
    return pixel.model_copy(update={"prnu": 0.0})


def counted(electrons: PerValue, pixel: Pixel) -> Float[Array, "3 values"]:
    """Return the moments of pixels without PRNU."""
    from .kernels import poisson_means  # noqa: PLC0415  (compiled: kept off the start-up path)

    result = linear_moments(electrons, pixel)
    for run, first, counts in runs(electrons, pixel):
        result[:, run] = poisson_means(electrons[run], first, counts[:2], counts[2])
    return result


def runs(electrons: PerValue, pixel: Pixel) -> Iterator[tuple[slice, int, Float[Array, "3 _values"]]]:
    """Yield runs of expected electrons whose counts are summed.

    Each is a range of electrons, their first count, and `of_count` from it on.
    """
    felt = _felt(electrons, pixel)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], felt, [False]])))
    for left, right in zip(edges[::2], edges[1::2], strict=True):
        first, last = counts_of(electrons[left:right], pixel)
        yield slice(left, right), first, of_count(np.arange(first, last + 1, dtype=float), pixel)


def counts_of(electrons: PerValue, pixel: Pixel) -> tuple[int, int]:
    """Return the first and last count of expected numbers of electrons; the full well holds no more."""
    low, high = electrons[0], electrons[-1]
    first = max(0, math.floor(low - (_REACH + 1) * math.sqrt(low)))
    full = math.ceil(LinearRange.of(pixel).full_e)
    most = math.ceil(high + (_REACH + 1) * math.sqrt(high) + (_REACH + 1) ** 2)
    return min(first, full), max(min(most, full), min(first, full))


def table_nodes(pixel: Pixel) -> Float[Array, " nodes"]:
    """Return the roots of the electrons at which a table without PRNU is computed.

    Returns roots, ascending from 0.
    """
    ends = LinearRange.of(pixel)
    last = math.sqrt(_least_exceeding(ends.full_e))
    every = np.arange(0, last + 2 * STEP, STEP)
    # A straight readout is a parabola in the root, which a cubic meets with few nodes.
    smooth = ~_felt(every**2, pixel) & (pixel.dn_per_e * np.hypot(every, pixel.read_noise_e) > gaussian.SMOOTH_DN)
    inner = smooth.copy()
    inner[1:] &= smooth[:-1]
    inner[:-1] &= smooth[1:]
    at = np.arange(every.size)
    # Where nothing but the steps of rounding shows, half a DN at most, half as many nodes are still good for 1e-6 DN.
    bent = (every < _FAR_ROOT) | (every > math.sqrt(max(ends.high_e, 0.0)) - _FAR_ROOT)
    return np.asarray(every[(bent & ~inner) | (~inner & (at % 2 == 0)) | (at % 64 == 0)], dtype=float)


@lru_cache(maxsize=8)
def table_without_prnu(pixel: Pixel) -> CubicSpline:
    """Return `counted` as a spline over the root of the electrons."""
    from scipy.interpolate import CubicSpline  # noqa: PLC0415  (slow to import: kept off the start-up path)

    roots = table_nodes(pixel)
    return CubicSpline(roots, counted(roots**2, pixel), axis=1)


def with_prnu(electrons: PerValue, pixel: Pixel) -> Float[Array, "3 values"]:
    """Return the moments by the trapezoidal rule over Gaussian gains of the pixels.

    The integrand is a Gaussian times a function that is smooth over a deviation 2 / (prnu root of the electrons), so
    that the rule converges exponentially; its step leaves less than 1e-13.
    """
    from .kernels import means_over_gains  # noqa: PLC0415  (compiled: kept off the start-up path)

    even = without_prnu(pixel)
    table = table_without_prnu(even)
    result = linear_moments(electrons, pixel)
    spread = 1 + DRAWN * pixel.prnu
    ends = LinearRange.of(pixel)
    felt = _felt(electrons * spread, even) | _felt(electrons * (2 - spread), even)
    in_table = np.flatnonzero(felt & (electrons <= ends.last_e * 2))
    averaged = np.empty((3, in_table.size))
    means_over_gains(electrons[in_table], pixel.prnu, DRAWN, _PER_DEVIATION, table.x, table.c, averaged)
    result[:, in_table] = averaged
    return result


def moments(electrons: PerValue, pixel: Pixel) -> Float[Array, "3 values"]:
    """Return the moments of the digital number, by exact sums.

    Returns mean before rounding and after, DN, and variance after rounding, DN^2.
    """
    return with_prnu(electrons, pixel) if pixel.prnu else counted(electrons, pixel)
