"""Captures of one exposure: which of them are below their thresholds, and their moments then.

The captures of an exposure read the same Poisson electrons with independent read noise. For each subset of them, the
table has the probability that exactly these are usable, and the conditional mean and covariance of what they read, in
electrons. All are exact sums over the numbers of electrons, with full well, ADC range and rounding.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from ...base.types import Array, Float, PerCapture, PerValue, SameShape
from ..pixel import Pixel
from . import gaussian
from .moments import LinearRange, counts_of

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

_STEP = 1 / 32
"""Distance of nodes in the root of the electrons, in which Poisson means are smooth at a scale of 1/2."""
_AT_ONCE = 256
"""Nodes whose counts are summed together."""
_NEVER = 1e-18
"""Probability below which conditional moments are left out."""
Subset = tuple[int, ...]


def threshold_dn(pixel: Pixel, threshold: float) -> int:
    """Return the least digital number from which on a capture is not used.

    `pixel`: capture, as a pixel that is read once.
    """
    saturated_dn = min(pixel.saturation_e * pixel.dn_per_e + pixel.offset_dn, pixel.full_scale_dn)
    return max(1, math.ceil(pixel.offset_dn + threshold * (saturated_dn - pixel.offset_dn)))


@dataclass(frozen=True)
class SubsetMoments:
    """Moments of the captures of an exposure if exactly some of them are usable.

    `mean_e`: conditional means, electrons; 0 for captures that are not usable.
    """

    share: SameShape
    mean_e: Float[Array, " captures *batch"]
    covariance_e2: Float[Array, "captures captures *batch"]


@dataclass(frozen=True)
class SubsetTable:
    """Moments over the root of the expected electrons.

    `splines`: share, means less the expected electrons, and covariances, by subset; `last_e`: expected electrons from
    which on all is constant.
    """

    subsets: tuple[Subset, ...]
    splines: tuple[CubicSpline, ...]
    last_e: float
    n_captures: int

    def at(self, electrons: PerCapture) -> dict[Subset, SubsetMoments]:
        """Look up expected electrons."""
        held = np.minimum(electrons, self.last_e)
        roots, n = np.sqrt(held), self.n_captures
        moments = {}
        for subset, spline in zip(self.subsets, self.splines, strict=True):
            rows = spline(roots)
            mean_e, covariance_e2 = np.zeros((n, *roots.shape)), np.zeros((n, n, *roots.shape))
            for at, first in enumerate(subset, 1):
                mean_e[first] = rows[at] + held
            for at, (first, second) in enumerate(_pairs(subset), 1 + len(subset)):
                covariance_e2[first, second] = covariance_e2[second, first] = rows[at]
            moments[subset] = SubsetMoments(np.clip(rows[0], 0.0, 1.0), mean_e, covariance_e2)
        return moments


def _pairs(subset: Subset) -> list[tuple[int, int]]:
    return list(itertools.combinations_with_replacement(subset, 2))


def share_beyond(counts: PerValue, pixel: Pixel, limit_dn: int) -> PerValue:
    """Return the probability that a capture reads its limit or more, for given numbers of electrons.

    `pixel`: capture, as a pixel that is read once.
    """
    over = pixel.dn_per_e * np.minimum(counts, pixel.well_e) + pixel.offset_dn - (limit_dn - 0.5)
    sigma = pixel.dn_per_e * pixel.read_noise_e
    return gaussian.share_below(over / sigma) if sigma else (over >= 0).astype(float)


def usable_of_count(counts: PerValue, pixel: Pixel, limit_dn: int | None) -> tuple[PerValue, PerValue, PerValue]:
    """Return the chance that a capture is usable, and its partial moments, for given numbers of electrons.

    `pixel`: capture, as a pixel that is read once; `limit_dn`: digital number from which on it is not usable; None if
    it always is. Returns probability, mean and mean square of what it reads, electrons, where it is usable, and 0 where
    not.
    """
    gain, top = pixel.dn_per_e, float(pixel.full_scale_dn if limit_dn is None else limit_dn)
    sigma = gain * pixel.read_noise_e
    mean_dn = gain * np.minimum(counts, pixel.well_e) + pixel.offset_dn
    first, variance = gaussian.clipped_and_rounded(mean_dn, sigma, top)
    second, share = variance + first**2, np.ones_like(counts)
    if limit_dn is not None:
        # Digital numbers from the threshold on count as the threshold, and are taken away.
        beyond = share_beyond(counts, pixel, limit_dn)
        share = 1 - beyond
        first, second = first - top * beyond, second - top**2 * beyond
    offset = pixel.offset_dn
    first_e = (first - offset * share) / gain
    return share, first_e, (second - 2 * offset * first + offset**2 * share) / gain**2


@lru_cache(maxsize=16)
def subset_table(captures: tuple[Pixel, ...], limits_dn: tuple[int | None, ...]) -> SubsetTable:
    """Compute the table of an exposure without PRNU.

    `captures`: captures, as pixels that are read once; `limits_dn`: digital number from which on each is not usable;
    None if it always is.
    """
    from scipy.interpolate import CubicSpline  # noqa: PLC0415  (slow to import: kept off the start-up path)

    last_e = max(LinearRange.of(pixel).last_e for pixel in captures)
    roots = np.arange(0, math.sqrt(last_e) + 2 * _STEP, _STEP)
    blocks = [_moments(roots[at : at + _AT_ONCE] ** 2, captures, limits_dn) for at in range(0, roots.size, _AT_ONCE)]
    subsets = tuple(blocks[0])
    rows = [np.concatenate([block[subset] for block in blocks], axis=1) for subset in subsets]
    return SubsetTable(subsets, tuple(CubicSpline(roots, of, axis=1) for of in rows), last_e, len(captures))


def _moments(
    electrons: PerValue, captures: Sequence[Pixel], limits_dn: Sequence[int | None]
) -> dict[Subset, Float[Array, "_moments _values"]]:
    """Return rows of `SubsetTable` at ascending expected electrons by summing over counts."""
    from .kernels import poisson_means  # noqa: PLC0415  (compiled: kept off the start-up path)

    ranges = [counts_of(electrons, pixel) for pixel in captures]
    first, last = min(low for low, _ in ranges), max(high for _, high in ranges)
    counts = np.arange(first, last + 1, dtype=float)
    read = [usable_of_count(counts, *each) for each in zip(captures, limits_dn, strict=True)]
    numbers, result = range(len(captures)), {}
    always = tuple(number for number in numbers if limits_dn[number] is None)
    for size in range(len(captures) + 1):
        for subset in itertools.combinations(numbers, size):
            if not set(always) <= set(subset):
                continue
            others = [1 - read[number][0] for number in numbers if number not in subset]
            rest = np.prod(others, axis=0) if others else np.ones_like(counts)
            # Partial moments about the first count, so that few digits are lost.
            shares = {number: read[number][0] for number in subset}
            means = {number: read[number][1] - first * shares[number] for number in subset}
            squares = {n: read[n][2] - 2 * first * read[n][1] + first**2 * shares[n] for n in subset}
            rows = [_product(shares, (), rest, means, squares)]
            rows += [_product(shares, (number,), rest, means, squares) for number in subset]
            rows += [_product(shares, pair, rest, means, squares) for pair in _pairs(subset)]
            summed = poisson_means(electrons, first, np.stack(rows))[:-1]
            share = summed[0]
            known = share > _NEVER
            within = np.divide(summed[1:], share, out=np.zeros_like(summed[1:]), where=known)
            mean = within[:size]
            covariance = [
                within[size + at] - mean[subset.index(capture_a)] * mean[subset.index(capture_b)]
                for at, (capture_a, capture_b) in enumerate(_pairs(subset))
            ]
            less = np.where(known, mean + first - electrons, 0.0)
            result[subset] = np.concatenate([share[None], less, np.array(covariance).reshape(-1, electrons.size)])
    return result


def _product(
    shares: dict[int, Float[Array, " entries"]],
    of: Sequence[int],
    rest: PerValue,
    means: dict[int, Float[Array, " entries"]],
    squares: dict[int, Float[Array, " entries"]],
) -> PerValue:
    """Return the partial moment of captures for each count: the product over independent read noise."""
    value = rest
    for number, share in shares.items():
        times = of.count(number) if isinstance(of, tuple) else 0
        value = value * (share, means[number], squares[number])[times]
    return value
