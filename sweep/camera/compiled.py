"""Compiled inner loops of noise: sums over electrons and digital numbers. They release the GIL."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from ..types import FloatArray

_TAIL = 9.5
"""Standard deviations beyond which a Gaussian is left out: less than 1e-20 of it."""
_NONE = np.empty(0)
_RARE = 1e-22
"""Numbers of electrons that occur less often than this, relative to the most frequent one, are left out."""


@njit(cache=True, nogil=True)
def rounded_gaussian(mean: FloatArray, sigma: float, top: float, out: FloatArray) -> None:
    """Mean and variance of round(clip(x, 0, top)) for Gaussian x, by the probability to pass each step.

    `mean`: ndarray[n], `sigma` > 0; `out`: ndarray[2, n].
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
    """How often each count from `start` on occurs, relative to the most frequent; where these begin and end.

    `shares`: ndarray[n_counts], filled between the two; its last count takes all higher ones, too. Counts that occur
    less often than `rare` are left out.
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


@njit(cache=True, nogil=True)
def poisson_moments(
    electrons: FloatArray, start: int, values: FloatArray, variance: FloatArray, out: FloatArray
) -> None:
    """Means of several quantities of a Poisson number of electrons; the variance of the last one, where asked for.

    `electrons`: ndarray[n], expected numbers. `values`: ndarray[n_quantities, n_counts], of the counts from `start`
    on; beyond the last count they stay as they are. `variance`: ndarray[n_counts], the last quantity's own at each
    count, or empty. `out`: ndarray[n_quantities + 1, n].
    """
    quantities, counts = values.shape
    shares = np.empty(counts)
    for i in range(electrons.size):
        low, high = poisson_shares(electrons[i], start, _RARE, shares)
        weight = shares[low:high].sum()
        at = min(int(electrons[i]) - start, counts - 1)
        for q in range(quantities):
            # About the value at the most frequent count, so that no digits are lost.
            total = 0.0
            for k in range(low, high):
                total += shares[k] * (values[q, k] - values[q, at])
            out[q, i] = values[q, at] + total / weight
        if variance.size:
            total = 0.0
            for k in range(low, high):
                off = values[quantities - 1, k] - out[quantities - 1, i]
                total += shares[k] * (variance[k] + off * off)
            out[quantities, i] = total / weight


def poisson_means(electrons: FloatArray, start: int, values: FloatArray, variance: FloatArray = _NONE) -> FloatArray:
    """`poisson_moments` into a new ndarray[n_quantities + 1, n]."""
    out = np.empty((len(values) + 1, electrons.size))
    poisson_moments(np.ascontiguousarray(electrons), start, values, variance, out)
    return out
