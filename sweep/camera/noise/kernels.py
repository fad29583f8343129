"""Compiled inner loops of noise: sums over electrons and digital numbers. They release the GIL."""

from __future__ import annotations

import math

import numpy as np

from ...base.machine_code import njit
from ...base.types import FloatArray, IndexArray

_TAIL = 9.5
"""Standard deviations beyond which a Gaussian is left out: less than 1e-20 of it."""
_NONE = np.empty(0)
_RARE = 1e-22
"""Numbers of electrons that occur less often than this, relative to the most frequent one, are left out."""
_RARE_COUNT, _MOST_GAIN, _RARE_CAPTURE = 1e-25, 9.0, 1e-40
"""The same for merged values, standard deviations of gains beyond which these are left out, and least probability that
a capture is used."""


@njit(cache=True, nogil=True)
def rounded_gaussian(mean: FloatArray, sigma: float, top: float, out: FloatArray) -> None:
    """Compute mean and variance of round(clip(x, 0, top)) for Gaussian x, by the probability of passing each step.

    `sigma`: standard deviation, above 0.
    """
    scale = 1 / (sigma * math.sqrt(2))
    for i in range(mean.size):
        center = min(max(math.floor(mean[i] + 0.5), 0.0), top)
        first = second = 0.0
        for side in (1.0, -1.0):
            room = top - center if side > 0 else center
            step = 1.0
            while step <= room:
                z = side * (center - mean[i]) + step - 0.5
                if z > _TAIL * sigma:
                    break
                passed = 0.5 * math.erfc(z * scale)
                first += side * passed
                second += (2 * step - 1) * passed
                step += 1
        out[0, i] = center + first
        out[1, i] = max(second - first * first, 0.0)


@njit(cache=True, nogil=True)
def poisson_shares(electrons: float, start: int, rare: float, shares: FloatArray) -> tuple[int, int]:
    """Compute the probability of each count, relative to the most frequent one.

    `rare`: counts below this relative probability are left out. `shares` is filled between the two returned indices;
    its last count takes all higher ones.
    """
    last, mode = shares.size - 1, int(electrons)
    low = high = min(mode - start, last)
    shares[low] = 0.0
    share, k = 1.0, mode
    while share > rare:
        here = min(k - start, last)
        if here > high:
            high = here
            shares[here] = 0.0
        shares[here] += share
        k += 1
        share *= electrons / k
    share, k = mode / max(electrons, 1e-300), mode - 1
    while share > rare and k >= start:
        here = min(k - start, last)
        if here < low:
            low = here
            shares[here] = 0.0
        shares[here] += share
        share *= k / electrons
        k -= 1
    return low, high + 1


@njit(cache=True, nogil=True, fastmath={"contract", "reassoc"})
def _sum_squared_deviation(shares: FloatArray, values: FloatArray, about: float) -> float:
    """Sum of values less one of them, by their shares."""
    total = 0.0
    for k in range(shares.size):
        total += shares[k] * (values[k] - about)
    return total


@njit(cache=True, nogil=True, fastmath={"contract", "reassoc"})
def _sum_square(shares: FloatArray, values: FloatArray, about: float, variance: FloatArray) -> float:
    """Sum of variances and of the squares of values less another one, by their shares."""
    total = 0.0
    for k in range(shares.size):
        deviation = values[k] - about
        total += shares[k] * (variance[k] + deviation * deviation)
    return total


@njit(cache=True, nogil=True)
def poisson_moments(
    electrons: FloatArray, start: int, values: FloatArray, variance: FloatArray, out: FloatArray
) -> None:
    """Compute means of several quantities of a Poisson number of electrons, and the variance of the last one.

    `values`: quantities at each count; constant beyond the last count; `variance`: variance of the last quantity at
    each count, if requested.
    """
    quantities, counts = values.shape
    shares = np.empty(counts)
    for i in range(electrons.size):
        low, high = poisson_shares(electrons[i], start, _RARE, shares)
        in_range = shares[low:high]
        weight = in_range.sum()
        at = min(int(electrons[i]) - start, counts - 1)
        for q in range(quantities):
            # About the value at the most frequent count, so that no digits are lost.
            out[q, i] = values[q, at] + _sum_squared_deviation(in_range, values[q, low:high], values[q, at]) / weight
        if variance.size:
            last = values[quantities - 1, low:high]
            out[quantities, i] = _sum_square(in_range, last, out[quantities - 1, i], variance[low:high]) / weight


@njit(cache=True, nogil=True)
def means_over_gains(
    electrons: FloatArray,
    prnu: float,
    drawn: float,
    per_deviation: float,
    roots: FloatArray,
    table: FloatArray,
    out: FloatArray,
) -> None:
    """Compute means over Gaussian gains of the pixels by the trapezoidal rule, and the variance of the last mean.

    `drawn`: standard deviations beyond which gains are left out; `per_deviation`: steps per standard deviation, more
    where there are more electrons; `roots`, `table`: nodes and coefficients of a cubic spline over the root of the
    electrons: two means and the variance.
    """
    for i in range(electrons.size):
        half = math.ceil(drawn * per_deviation * math.sqrt(1 + prnu * prnu * electrons[i]))
        weight = first = second = square = spread = 0.0
        # About the value of the mean gain, so that no digits are lost.
        root = min(math.sqrt(electrons[i]), roots[-1])
        at = max(np.searchsorted(roots, root) - 1, 0)
        s, c = root - roots[at], table[:, at, 1]
        about, at = ((c[0] * s + c[1]) * s + c[2]) * s + c[3], 0
        for k in range(-half, half + 1):
            z = drawn * k / half
            root = min(math.sqrt(electrons[i] * (1 + prnu * z)), roots[-1])
            while at < roots.size - 2 and root >= roots[at + 1]:
                at += 1
            s, of = root - roots[at], table[:, at]
            unrounded = ((of[0, 0] * s + of[1, 0]) * s + of[2, 0]) * s + of[3, 0]
            rounded = ((of[0, 1] * s + of[1, 1]) * s + of[2, 1]) * s + of[3, 1]
            variance = ((of[0, 2] * s + of[1, 2]) * s + of[2, 2]) * s + of[3, 2]
            share = math.exp(-0.5 * z * z)
            weight += share
            first += share * unrounded
            second += share * (rounded - about)
            square += share * (rounded - about) ** 2
            spread += share * max(variance, 0.0)
        mean = second / weight
        out[0, i] = first / weight
        out[1, i] = about + mean
        out[2, i] = spread / weight + square / weight - mean * mean


def poisson_means(electrons: FloatArray, start: int, values: FloatArray, variance: FloatArray = _NONE) -> FloatArray:
    """Return the result of `poisson_moments` in a new array."""
    out = np.empty((len(values) + 1, electrons.size))
    poisson_moments(np.ascontiguousarray(electrons), start, values, variance, out)
    return out


@njit(cache=True, nogil=True)
def occurring(shares: FloatArray, rare: float) -> tuple[int, int]:
    """Return the range of shares without the rare ones at both ends.

    `rare`: probability below which one is left out. Returns the first index, and that after the last.
    """
    low, high = 0, shares.size
    while low + 1 < high and shares[low] < rare:
        low += 1
    while high - 1 > low and shares[high - 1] < rare:
        high -= 1
    return low, high


@njit(cache=True, nogil=True)
def merged_shares(
    electrons: FloatArray,
    prnu: float,
    exposure: IndexArray,
    passed: FloatArray,
    starts: IndexArray,
    columns: IndexArray,
    shares: FloatArray,
    n_bins: int,
) -> tuple[int, FloatArray]:
    """Return the distribution of the merged value of an HDR pixel."""
    n_captures, n_exposures, n_counts = passed.shape
    total, brightest = np.zeros(n_bins), electrons.max()
    half = int(_MOST_GAIN * math.sqrt(1 + prnu * prnu * brightest)) + 1 if prnu > 0 else 0
    counts, before = np.empty((n_exposures, n_counts)), np.empty((n_captures, n_exposures))
    ends, first, last = (
        np.empty((n_exposures, 2), np.intp),
        np.full(n_exposures, n_counts),
        np.zeros(n_exposures, np.intp),
    )
    chosen = np.zeros((n_captures, n_counts))
    all_gains = 0.0
    for i in range(-half, half + 1):
        z = _MOST_GAIN * i / half if half else 0.0
        weight = math.exp(-z * z / 2)
        all_gains += weight
        for at in range(n_exposures):
            ends[at] = poisson_shares(max(electrons[at] * (1 + prnu * z), 0.0), 0, _RARE_COUNT, counts[at])
            first[at], last[at] = min(first[at], ends[at, 0]), max(last[at], ends[at, 1])
            shares_of_counts = counts[at, ends[at, 0] : ends[at, 1]]
            shares_of_counts /= shares_of_counts.sum()
            for k in range(n_captures):
                before[k, at] = (shares_of_counts * passed[k, at, ends[at, 0] : ends[at, 1]]).sum()
        for k in range(n_captures):
            others = weight
            for at in range(n_exposures):
                if at != exposure[k]:
                    others *= before[k, at]
            if others < _RARE_CAPTURE:
                continue
            for count in range(ends[exposure[k], 0], ends[exposure[k], 1]):
                chosen[k, count] += others * counts[exposure[k], count]
    for k in range(n_captures):
        for count in range(first[exposure[k]], last[exposure[k]]):
            for entry in range(starts[k, count], starts[k, count + 1]):
                total[columns[entry]] += chosen[k, count] * shares[entry]
    low, high = occurring(total, _RARE_COUNT)
    return low, total[low:high] / all_gains
