"""Compiled inner loops of errors: how far the digital numbers of two signals overlap, and which signal is likeliest."""

from __future__ import annotations

import math

import numpy as np

from ..base.machine_code import njit
from ..base.types import FloatArray, IndexArray
from .compiled import RARE

_MOST_NATS = 100.0
"""Logarithms of a likelihood ratio beyond this are taken to say nothing, which bounds the error from above."""
_COARSE = 4
"""Steps of these logarithms that are taken together, to find out whether two signals need a closer look."""


@njit(cache=True, nogil=True)
def overlaps(firsts: IndexArray, starts: IndexArray, roots: FloatArray, rows: IndexArray) -> FloatArray:
    """Bhattacharyya coefficient of each two signals of a design, ndarray[n_signals, n_signals].

    `rows`: ndarray[n_channels, n_signals], the row of `firsts` and `starts` that each has; `roots`: of the shares.
    """
    found = np.ones((rows.shape[1], rows.shape[1]))
    for a in range(rows.shape[1]):
        for b in range(a):
            for c in range(rows.shape[0]):
                one, other = rows[c, a], rows[c, b]
                if one == other:
                    continue
                i, j, n = _common(firsts, starts, one, other)
                total = 0.0
                for k in range(n):
                    total += roots[i + k] * roots[j + k]
                found[a, b] *= total
                if total == 0:
                    break
            found[b, a] = found[a, b]
    return found


@njit(cache=True, nogil=True)
def _common(firsts: IndexArray, starts: IndexArray, one: int, other: int) -> tuple[int, int, int]:
    """Where the bins that two rows share begin in each, and how many there are."""
    low = max(firsts[one], firsts[other])
    high = min(firsts[one] + starts[one + 1] - starts[one], firsts[other] + starts[other + 1] - starts[other])
    return starts[one] + low - firsts[one], starts[other] + low - firsts[other], max(high - low, 0)


@njit(cache=True, nogil=True)
def _ratios(
    firsts: IndexArray, starts: IndexArray, roots: FloatArray, logs: FloatArray, one: int, other: int, step: float
) -> tuple[int, FloatArray]:
    """Overlap of one channel by the logarithm of the likelihood ratio, in steps: the first step, shares from it on."""
    i, j, n = _common(firsts, starts, one, other)
    most = int(_MOST_NATS / step)
    found = np.zeros(2 * most + 1)
    begin, end = 2 * most, 0
    for k in range(n):
        p, q = roots[i + k], roots[j + k]
        if p > 0 and q > 0:
            at = round(min(max(2 * (logs[i + k] - logs[j + k]) / step, -most), most)) + most
            found[at] += p * q
            begin, end = min(begin, at), max(end, at)
    if end < begin:
        return 0, np.zeros(1)
    return begin - most, found[begin : end + 1]


@njit(cache=True, nogil=True)
def _sum_of_few(one: FloatArray, other: FloatArray) -> FloatArray:
    """Shares of the sum of two numbers, from the sum of their first ones on, of which few occur in a long range."""
    found, occurring = np.zeros(one.size + other.size - 1), np.flatnonzero(other)
    for i in range(one.size):
        if one[i] > RARE:
            for j in occurring:
                found[i + j] += one[i] * other[j]
    return found


@njit(cache=True, nogil=True)
def _least_error(
    firsts: IndexArray,
    starts: IndexArray,
    roots: FloatArray,
    logs: FloatArray,
    rows: IndexArray,
    a: int,
    b: int,
    step: float,
) -> float:
    """Error of the most likely of two equally frequent signals.

    Half the sum of min(p, q), that is of sqrt(p q) exp(-|ln(p / q)| / 2); the logarithms of independent channels add.
    Each is off by half a step at most, so that the error is exact within exp(n_channels step / 4).
    """
    # Two halves of the channels, so that their sum over both need not be written out.
    first, one, other = 0, np.ones(1), np.ones(1)
    for c in range(rows.shape[0]):
        if rows[c, a] != rows[c, b]:
            own_first, own = _ratios(firsts, starts, roots, logs, rows[c, a], rows[c, b], step)
            first += own_first
            if one.size <= other.size:
                one = _sum_of_few(one, own)
            else:
                other = _sum_of_few(other, own)
    return 0.5 * _mean_decay(one, other, first, step / 2)


@njit(cache=True, nogil=True)
def _mean_decay(one: FloatArray, other: FloatArray, first: int, rate: float) -> float:
    """Sum of one[i] other[j] exp(-rate |first + i + j|), by the sums of `other` on either side of where that turns."""
    n, decay = other.size, math.exp(-rate)
    before, after = np.zeros(n + 1), np.zeros(n + 1)  # of other[m] exp(-rate |j - m|), for m < j and m >= j
    for m in range(n):
        before[m + 1] = (before[m] + other[m]) * decay
        after[n - 1 - m] = other[n - 1 - m] + after[n - m] * decay
    total = 0.0
    for i in range(one.size):
        if one[i] > 0:
            turn = min(max(-(first + i), 0), n)
            total += one[i] * (before[turn] + after[turn]) * math.exp(-rate * abs(first + i + turn))
    return total


@njit(cache=True, nogil=True)
def largest_error(
    overlap: FloatArray,
    first: IndexArray,
    second: IndexArray,
    firsts: IndexArray,
    starts: IndexArray,
    roots: FloatArray,
    logs: FloatArray,
    rows: IndexArray,
    step: float,
) -> float:
    """Largest error of two signals over the pairs of two types: those whose overlap leaves room for it, largest first.

    And whose error by larger steps leaves room, too, by as much as either may be off. `overlap`, `firsts`, `starts`,
    `roots`, `rows`: as in `overlaps`; `logs`: of the roots; `first`, `second`: signals of each type.
    """
    bound = np.empty(first.size * second.size)
    for a in range(first.size):
        for b in range(second.size):
            bound[a * second.size + b] = overlap[first[a], second[b]]
    found, looked_at = 0.0, np.zeros(bound.size, dtype=np.bool_)
    off = math.exp((_COARSE + 1) * len(rows) * step / 4)
    while bound.size:  # few are looked at, so that sorting them all is not worth it
        at = 0
        for k in range(bound.size):
            if bound[k] > bound[at]:
                at = k
        if not 0.5 * bound[at] > found:
            break
        a, b = first[at // second.size], second[at % second.size]
        if not looked_at[at]:
            about = _least_error(firsts, starts, roots, logs, rows, a, b, _COARSE * step)
            bound[at], looked_at[at] = min(bound[at], 2 * off * about), True
            continue
        found = max(found, _least_error(firsts, starts, roots, logs, rows, a, b, step))
        bound[at] = 0.0
    return found


@njit(cache=True, nogil=True)
def likeliest(values: FloatArray, mean: FloatArray, variance: FloatArray, out: IndexArray) -> None:
    """The signal with the largest Gaussian likelihood at readouts, ndarray[n, n_channels]; of several the first.

    `mean`, `variance`: of each channel's signals, C-ordered ndarray[n_channels, n_signals].
    """
    logarithms, unlike = np.log(variance), np.empty(mean.shape[1])
    for i in range(len(values)):
        unlike[:] = 0.0
        for c in range(len(mean)):
            for s in range(unlike.size):
                apart = values[i, c] - mean[c, s]
                unlike[s] += apart * apart / variance[c, s] + logarithms[c, s]
        out[i] = np.argmin(unlike)
