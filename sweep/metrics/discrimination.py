"""Error probability of two signal types from mean and variance of the readout of each signal.

The channels of a mosaic are read from different pixels, so their noise is independent and a covariance is diagonal. A
channel without variance separates two signals for certain, unless their means are equal; then it has no effect.

Forms of two signals take the difference of their means, DN, and both variances, DN^2, channels on the last axis.

An error is that of Gaussians with these moments. With a `NoiseShape`, a bound is that of Gaussians in the channels
with Gaussian noise, or Bennett's from all channels, whichever is less: leaving channels out is a rule, too.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ..base.types import (
    Array,
    Bool,
    BoolArray,
    DesignSignals,
    Float,
    IndexArray,
    Int,
    MemberNumbers,
    PerDesign,
)
from ..camera.noise.gaussian import share_below
from ..camera.readout import NoisyReadout
from ..spectra.lights import Pair, class_pairs
from .complex_step import Smooth, length, ratio
from .separation import pair_blocks

_Both = tuple[IndexArray, IndexArray]
_LEAST_VARIANCE = 2e-9
"""Variance, DN^2, that a channel may have although it counts as certain."""
_LEFT_OUT = 1e-12
"""A pixel of up to a thousand goes beyond its reach at most this often; Gaussian tails are trusted down to here."""


def dprime(difference: Smooth, first: Smooth, second: Smooth) -> Smooth:
    """Return d' = sqrt(D' S^-1 D), S the mean of both variances.

    This is d_a of signal detection theory for unequal variances (Simpson and Fitter, 1973), in several channels.
    """
    return length(ratio(difference, np.sqrt((first + second) / 2)))


def noise_along(difference: Smooth, first: Smooth, second: Smooth) -> Smooth:
    """Return the noise along the line of two points: sqrt(u' S u) for the unit vector u, S the mean of both variances.

    0 for coincident points.
    """
    return length(ratio(difference, length(difference)[..., None]) * np.sqrt((first + second) / 2))


def contrast(difference: Smooth, first: Smooth, second: Smooth) -> Smooth:
    """Return the distance of two points over the noise along their line; 0 for coincident points."""
    return ratio(length(difference), noise_along(difference, first, second))


def margin(difference: Smooth, first: Smooth, second: Smooth) -> Smooth:
    """Return the standard deviations from both points to the plane between them at which they err equally often.

    With normal S^-1 D, S the mean covariance: D' S^-1 D / (s_a + s_b), with the standard deviation s of each along the
    normal (Fukunaga, "Introduction to Statistical Pattern Recognition", linear classifiers). 0 for coincident points.
    """
    total = first + second
    z = ratio(difference, np.sqrt(total))
    distance = length(z)
    certain = np.isinf(distance)
    z = np.where(certain[..., None], 0.0, z)
    ours, theirs = (np.divide(v, total, out=np.full_like(total, 0.5), where=total.real > 0) for v in (first, second))
    spread = length(z * np.sqrt(ours)) + length(z * np.sqrt(theirs))
    return np.where(certain, np.inf, distance * ratio(distance, spread))


def overlap(difference: Smooth, first: Smooth, second: Smooth) -> Smooth:
    """Return the Bhattacharyya distance of Gaussians: D'S^-1 D / 8 + ln(S / sqrt(Sa Sb)) / 2.

    Where one variance is 0 the logarithm is left out, since digital numbers are steps; the coefficient is then larger,
    and still a bound.
    """
    z = ratio(difference, np.sqrt(first + second))
    noisy, less = (first.real > 0) & (second.real > 0), first.real < second.real
    small, large = np.sqrt(np.where(less, first, second)), np.sqrt(np.where(less, second, first))
    r = np.divide(small, large, out=np.ones_like(small), where=noisy)
    # (Sa + Sb) / (2 sqrt(Sa Sb)) - 1 = (1 - r)^2 / (2 r) for r = sqrt(small / large): no digits are lost near 1.
    with np.errstate(over="ignore"):
        return np.asarray((z**2 / 4 + np.log1p((1 - r) ** 2 / (2 * r)) / 2).sum(axis=-1))


def contrast_to_noise(
    mean: DesignSignals, variance: DesignSignals, first: Int[IndexArray, " first"], second: Int[IndexArray, " second"]
) -> PerDesign:
    """Return CSD over noise: the `contrast` of the nearest two points.

    Of several pairs at exactly the same distance, the one with the most noise counts.
    """
    values = np.empty(len(mean))
    for block, _, difference, ours, theirs in _pairs(mean, variance, first, second):
        distance = length(difference)
        nearest = distance == distance.min(axis=1, keepdims=True)
        noise = np.where(nearest, noise_along(difference, ours, theirs), -1.0).max(axis=1)
        values[block] = ratio(distance.min(axis=1), noise)
    return values


def detectability(
    mean: DesignSignals, variance: DesignSignals, first: Int[IndexArray, " first"], second: Int[IndexArray, " second"]
) -> PerDesign:
    """Return d', the smallest over the pairs of two types."""
    smallest = np.empty(len(mean))
    for block, _, difference, ours, theirs in _pairs(mean, variance, first, second):
        smallest[block] = dprime(difference, ours, theirs).min(axis=1)
    return smallest


def pairwise_error(
    mean: DesignSignals, variance: DesignSignals, first: Int[IndexArray, " first"], second: Int[IndexArray, " second"]
) -> PerDesign:
    """Return the largest probability that noise moves one point of a pair beyond the other: Q of their `margin`.

    0.5 for coincident points.
    """
    errors = np.empty(len(mean))
    for block, _, difference, ours, theirs in _pairs(mean, variance, first, second):
        errors[block] = share_below(-margin(difference, ours, theirs)).max(axis=1)
    return errors


@dataclass(frozen=True)
class NoiseShape:
    """Shape of the noise.

    `gaussian`: True where it is Gaussian; same shape as the means.
    """

    gaussian: Bool[BoolArray, "designs signals channels"]
    reach_dn: DesignSignals

    @classmethod
    def of_cases(
        cls, read: NoisyReadout
    ) -> tuple[Float[Array, "_designs signals channels"], Float[Array, "_designs signals channels"], NoiseShape]:
        """Return mean, variance and shape of a readout, with cases and designs on one axis.

        Returns `mean, variance`: moments, DN and DN^2.
        """
        shape = (-1, *read.mean.shape[2:])
        noise = cls(read.gaussian.reshape(shape), read.reach_dn.reshape(shape))
        return read.mean.reshape(shape), read.variance.reshape(shape), noise

    def gaussian_only(
        self, block: slice, pair: _Both, difference: Float[Array, "designs pairs channels"]
    ) -> Float[Array, "designs pairs channels"]:
        """Return the differences in channels with Gaussian noise at both points, 0 in others, DN.

        `difference`: differences of the means, DN.
        """
        gaussian = self.gaussian[block]
        return np.where(gaussian[:, pair[0]] & gaussian[:, pair[1]], difference, 0.0)

    def bound(
        self,
        block: slice,
        pair: _Both,
        difference: Float[Array, "designs pairs channels"],
        total: Float[Array, "designs pairs channels"],
    ) -> Float[Array, "designs pairs"]:
        """Return a bound on the error on either side of a plane, for independent pixels of any distribution.

        Chernoff's bound exp((L_a(s) + L_b(-s)) / 2) for some s > 0, with the normal S^-1 D, and Bennett's inequality
        (1962) for the logarithms L of the moment generating functions: v / m^2 (exp(s m) - 1 - s m) for a sum of
        variance v whose terms are within m of their means.

        `difference`, `total`: differences, DN, and sums of both variances, DN^2.
        """
        bound = np.full(difference.shape[:2], np.inf)
        # Each design for itself: what stands beside it in a block changes nothing.
        is_bounded = ~self.gaussian[block].all(axis=(1, 2))
        if not is_bounded.any():
            return bound
        difference = difference[is_bounded]
        reach = self.reach_dn[block][is_bounded]
        reach = np.maximum(reach[:, pair[0]], reach[:, pair[1]])
        total = np.maximum(total[is_bounded], _LEAST_VARIANCE)
        normal = difference / np.maximum(total, reach**2 / 50)  # a plane that suits terms as rare as Bennett allows
        separation = (normal * difference).sum(axis=-1)
        least = np.zeros(separation.shape)
        for s in np.geomspace(1e-3, 10, 25):
            x = s * normal * reach
            with np.errstate(over="ignore"):
                least = np.minimum(least, (total / reach**2 * (np.expm1(x) - x)).sum(axis=-1) - s * separation)
        bound[is_bounded] = np.minimum(np.exp(least / 2) + _LEFT_OUT, 0.5)
        return bound


def error_bounds(
    mean: DesignSignals, variance: DesignSignals, members: Mapping[str, MemberNumbers], noise: NoiseShape | None = None
) -> tuple[dict[Pair, PerDesign], PerDesign]:
    """Return bounds on the error of the best rule, for the worst signal.

    The sum over the signals of other types of each pair's Bhattacharyya coefficient (Kailath, 1967), at most 1.

    `noise`: shape of the noise; left out, Gaussian.
    """
    bounds = {}
    state = np.zeros(mean.shape[:2])
    for pair in class_pairs(list(members)):
        first, second = (members[name] for name in pair)
        sums = np.zeros(mean.shape[:2])
        for block, signals, difference, ours, theirs in _pairs(mean, variance, first, second):
            if noise is None:
                coefficient = np.exp(-overlap(difference, ours, theirs))
            else:
                gaussian_difference = noise.gaussian_only(block, signals, difference)
                alike = np.broadcast_to(ours, gaussian_difference.shape)
                gaussian = (
                    np.exp(-overlap(gaussian_difference, alike, np.where(gaussian_difference > 0, theirs, alike)))
                    + _LEFT_OUT
                )
                sides = noise.bound(block, signals, difference, ours + theirs)
                coefficient = np.minimum(gaussian, np.where(sides < 0.5, sides, 1.0))
            coefficient = coefficient.reshape(len(difference), len(first), len(second))
            sums[block, first] += coefficient.sum(axis=2)
            sums[block, second] += coefficient.sum(axis=1)
        bounds[pair] = np.minimum(sums.max(axis=1), 1.0)
        state += sums
    return bounds, np.minimum(state.max(axis=1), 1.0)


def _pairs(
    mean: DesignSignals, variance: DesignSignals, first: Int[IndexArray, " first"], second: Int[IndexArray, " second"]
) -> Iterator[
    tuple[
        slice,
        _Both,
        Float[Array, "designs pairs channels"],
        Float[Array, "designs pairs channels"],
        Float[Array, "designs pairs channels"],
    ]
]:
    """Yield blocks of designs: slice, both signals of every pair, their difference and both variances."""
    for block, first_of_pair, second_of_pair in pair_blocks(mean.shape, first, second):
        ours, theirs = variance[block][:, first_of_pair], variance[block][:, second_of_pair]
        yield (
            block,
            (first_of_pair, second_of_pair),
            np.abs(mean[block][:, first_of_pair] - mean[block][:, second_of_pair]),
            ours,
            theirs,
        )
