"""Compiled inner loops of errors: the best plane between two signals. They release the GIL."""

from __future__ import annotations

import math

import numpy as np

from ..base.machine_code import njit
from ..base.types import FloatArray, IndexArray

_FAR = 150 * math.log(10)
"""Logarithm of the largest balance."""
_STEPS, _CLOSE = 60, 1e-9
"""Steps of Newton's method, halved where they leave their bracket, and last one: the margin depends on its square."""


@njit(cache=True, nogil=True)
def balance(difference: FloatArray, first: FloatArray, second: FloatArray, near: float = 0.0) -> float:
    """Return w = l / (1 - l) for which the sum of D^2 / (Va / l + Vb / (1 - l)) is largest.

    It is concave in l. Channels without difference or without variance have no say. `near`: a w beside it, if above 0.
    """
    apart = spread = 0.0
    low, high = np.inf, -np.inf
    for c in range(difference.size):
        if difference[c] != 0 and first[c] + second[c] > 0:
            apart, spread = max(apart, abs(difference[c])), max(spread, first[c], second[c])
            own = 0.5 * (math.log(max(first[c], 1e-300)) - math.log(max(second[c], 1e-300)))
            own = own if first[c] > 0 and second[c] > 0 else math.copysign(_FAR, own)
            low, high = min(low, own), max(high, own)
    if not low <= high:
        return 1.0
    low, high = max(low, -_FAR), min(high, _FAR)
    at = min(max(math.log(near), low), high) if near > 0.0 else 0.5 * (low + high)
    for _ in range(_STEPS if high - low > _CLOSE else 0):
        w, slope, bend = math.exp(at), 0.0, 0.0
        for c in range(difference.size):
            if difference[c] != 0 and first[c] + second[c] > 0:
                a, b = first[c] / spread, second[c] / spread
                total = a + b * w
                weight = (difference[c] / apart / total) ** 2
                slope += weight * (a - b * w * w)
                bend += weight * 2 * a * b * w * (1 + w) / total
        if slope > 0:
            low = at
        else:
            high = at
        moved = at + slope / bend if bend > 0 else low
        moved = moved if low < moved < high else 0.5 * (low + high)
        if abs(moved - at) <= _CLOSE:
            at = moved
            break
        at = moved
    return math.exp(at)


@njit(cache=True, nogil=True)
def margin_at(w: float, difference: FloatArray, first: FloatArray, second: FloatArray) -> float:
    """Return the margin at a balance: the largest at the best one; infinite where two signals are certain."""
    total = 0.0
    for c in range(difference.size):
        if difference[c] != 0:
            spread = math.sqrt(first[c] + w * second[c])
            own = abs(difference[c]) * math.sqrt(w / (1 + w)) / spread if spread != 0 else np.inf
            if math.isnan(own):
                return own
            total = math.hypot(total, own)
    return total


@njit(cache=True, nogil=True)
def balances(difference: FloatArray, first: FloatArray, second: FloatArray, out: FloatArray) -> None:
    """Fill `out` with the balance of each row."""
    for row in range(out.size):
        out[row] = balance(difference[row], first[row], second[row])


@njit(cache=True, nogil=True)
def smallest_margins(
    mean: FloatArray, variance: FloatArray, first: IndexArray, second: IndexArray, out: FloatArray
) -> None:
    """Fill `out` with the smallest margin of two types of signals in each design; NaN if one is unknown."""
    difference = np.empty(mean.shape[2])
    for design in range(out.size):
        out[design] = np.inf
        for one in first:
            for other in second:
                for c in range(difference.size):
                    difference[c] = mean[design, one, c] - mean[design, other, c]
                spreads = variance[design, one], variance[design, other]
                margin = margin_at(1.0, difference, *spreads)  # no more than the best
                if margin < out[design]:
                    best = margin_at(balance(difference, *spreads), difference, *spreads)
                    out[design] = min(max(margin, best), out[design])
                elif math.isnan(margin):
                    out[design] = np.nan
