"""Error probability of two signal types from mean and variance of the readout of each signal.

The channels of a mosaic are read from different pixels, so their noise is independent and a covariance is diagonal. A
channel without variance separates two signals for certain, unless their means are equal; then it has no effect.

With a `NoiseShape`, errors are those of Gaussians in the channels with Gaussian noise, or Bennett's bound from all
channels, whichever is less: leaving channels out is a rule, too; 1e-12 is the least. Without one, all noise is
Gaussian.
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
    SameShape,
)
from ..camera.noise.gaussian import share_below
from ..camera.readout import NoisyReadout
from ..spectra.lights import Pair, class_pairs
from .separation import pair_blocks

_Both = tuple[IndexArray, IndexArray]
_LEAST_VARIANCE = 2e-9
"""Variance, DN^2, that a channel may have although it counts as certain."""
_LEFT_OUT = 1e-12
"""A pixel of up to a thousand goes beyond its reach at most this often; Gaussian tails are trusted down to here."""


def contrast_to_noise(
    mean: DesignSignals, variance: DesignSignals, first: Int[IndexArray, " first"], second: Int[IndexArray, " second"]
) -> PerDesign:
    """Return CSD over noise: the standard deviation along the line between the nearest two points.

    The noise is sqrt(u' (Sa + Sb) / 2 u) for the unit vector u from one point to the other. Of several pairs at
    exactly the same distance, the one with the most noise counts.

    0 for coincident points.
    """
    ratio = np.empty(len(mean))
    for block, _, difference, ours, theirs in _pairs(mean, variance, first, second):
        distance = _length(difference)
        nearest = distance == distance.min(axis=1, keepdims=True)
        along = np.divide(difference, distance[..., None], out=np.zeros_like(difference), where=distance[..., None] > 0)
        floor = _length(along * np.sqrt((ours + theirs) / 2))
        floor = np.where(nearest, floor, -1.0).max(axis=1)
        contrast = distance.min(axis=1)
        ratio[block] = _ratio(contrast, floor)
    return ratio


def detectability(
    mean: DesignSignals, variance: DesignSignals, first: Int[IndexArray, " first"], second: Int[IndexArray, " second"]
) -> PerDesign:
    """Return d', the smallest over the pairs of two types: sqrt(D' S^-1 D), S the mean covariance of the two points.

    This is d_a of signal detection theory for unequal variances (Simpson and Fitter, 1973), in several channels.
    """
    smallest = np.empty(len(mean))
    for block, _, difference, ours, theirs in _pairs(mean, variance, first, second):
        z = _ratio(difference, np.sqrt((ours + theirs) / 2))
        smallest[block] = _length(z).min(axis=1)
    return smallest


def pairwise_error(
    mean: DesignSignals,
    variance: DesignSignals,
    first: Int[IndexArray, " first"],
    second: Int[IndexArray, " second"],
    shape: NoiseShape | None = None,
) -> PerDesign:
    """Return the largest probability that noise moves one point of a pair beyond the other.

    The pair is divided by a plane with normal S^-1 D, S the mean covariance, at which both points err equally often:
    Q(D' S^-1 D / (s_a + s_b)), with the standard deviation s of each along the normal (Fukunaga, "Introduction to
    Statistical Pattern Recognition", linear classifiers).

    `shape`: shape of the noise; left out, Gaussian. 0.5 for coincident points.
    """
    errors = np.empty((len(mean), len(first) * len(second)))
    for block, pair, difference, ours, theirs in _pairs(mean, variance, first, second):
        gaussian_difference = difference if shape is None else shape.gaussian_only(block, pair, difference)
        total = ours + theirs
        z = _ratio(gaussian_difference, np.sqrt(total))
        shares = [np.divide(v, total, out=np.full_like(total, 0.5), where=total > 0) for v in (ours, theirs)]
        length = _length(z)
        is_finite = ~np.isinf(length)
        z = np.where(is_finite[..., None], z, 0.0)
        spread = _length(z * np.sqrt(shares[0])) + _length(z * np.sqrt(shares[1]))
        error = share_below(-np.where(is_finite, length * _ratio(length, spread), np.inf))
        if shape is not None:
            error = np.maximum(error, _LEFT_OUT)
            error = np.minimum(error, shape.bound(block, pair, difference, total))
        errors[block] = error
    return np.asarray(errors.max(axis=1), dtype=float)


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
                overlap = np.exp(-_distance(difference, ours, theirs))
            else:
                gaussian_difference = noise.gaussian_only(block, signals, difference)
                alike = np.broadcast_to(ours, gaussian_difference.shape)
                gaussian = (
                    np.exp(-_distance(gaussian_difference, alike, np.where(gaussian_difference > 0, theirs, alike)))
                    + _LEFT_OUT
                )
                sides = noise.bound(block, signals, difference, ours + theirs)
                overlap = np.minimum(gaussian, np.where(sides < 0.5, sides, 1.0))
            overlap = overlap.reshape(len(difference), len(first), len(second))
            sums[block, first] += overlap.sum(axis=2)
            sums[block, second] += overlap.sum(axis=1)
        bounds[pair] = np.minimum(sums.max(axis=1), 1.0)
        state += sums
    return bounds, np.minimum(state.max(axis=1), 1.0)


def _distance(
    difference: Float[Array, "designs pairs channels"],
    ours: Float[Array, "#designs pairs channels"],
    theirs: Float[Array, "#designs pairs channels"],
) -> Float[Array, "designs pairs"]:
    """Return the Bhattacharyya distance of Gaussians: D'S^-1 D / 8 + ln(S / sqrt(Sa Sb)) / 2.

    Where one variance is 0 the logarithm is left out, since digital numbers are steps; the coefficient is then larger,
    and still a bound.
    """
    z = _ratio(difference, np.sqrt(ours + theirs))
    noisy = (ours > 0) & (theirs > 0)
    small, large = np.sqrt(np.minimum(ours, theirs)), np.sqrt(np.maximum(ours, theirs))
    ratio = np.divide(small, large, out=np.ones_like(small), where=noisy)
    # (Sa + Sb) / (2 sqrt(Sa Sb)) - 1 = (1 - r)^2 / (2 r) for r = sqrt(small / large): no digits are lost near 1.
    with np.errstate(over="ignore"):
        return np.asarray((z**2 / 4 + np.log1p((1 - ratio) ** 2 / (2 * ratio)) / 2).sum(axis=-1), dtype=float)


def _ratio(over: SameShape, under: SameShape) -> SameShape:
    """Return the ratio of non-negative numbers; 0 / 0 is 0, NaN stays NaN."""
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        return np.where((over == 0) & (under == 0), 0.0, over / under)


def _length(vectors: Float[Array, "*batch channels"]) -> SameShape:
    """Return the L2 norm over the last axis without squares; NaN where a component is NaN."""
    length, unknown = np.abs(vectors[..., 0]), np.isnan(vectors[..., 0])
    for at in range(1, vectors.shape[-1]):  # few, and a reduction over few is slow
        length = np.hypot(length, vectors[..., at])
        unknown |= np.isnan(vectors[..., at])
    return np.where(unknown, np.nan, length)


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
