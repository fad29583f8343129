"""Compiled inner loops: distances of pairs, without an array per step.

NumPy has to write every difference of every pair to memory; these keep them in registers and leave out the pairs that
cannot be the nearest. They release the GIL and are compiled once per machine (Numba's cache). Sums keep their order, so
that results are those of the same sums in NumPy.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..base.machine_code import njit
from ..base.types import BoolArray, FloatArray, IndexArray
from ..designs.vectorized import larger, smaller

_NUMBERS = {"nnan", "nsz"}
"""Lets the compiler take the smaller of several numbers at once; callers hand in no NaN."""
_LEAST_SQUARE, _MOST_SQUARE = 1e-280, 1e280
"""Squared distances below and above are those of differences whose squares a float does not hold well."""
Floats = np.ndarray[tuple[int, ...], np.dtype[Any]]
"""Float64, or float32 where that is exact."""
LANES = 64
"""Designs that `nearest_along_squared` takes side by side."""


@njit(cache=True, nogil=True, fastmath=_NUMBERS)
def nearest_squared(response: FloatArray, bounds: IndexArray, out: FloatArray) -> None:
    """Smallest squared distance of each pair of classes.

    `response`: C-ordered ndarray[n_designs, 4, n_signals], finite, one class of signals after the other, in which fewer
    channels are filled up with zeros;
    `bounds`: ndarray[n_classes + 1], where each class begins. `out`: ndarray[n_designs, n_pairs], pairs in the order of
    `curves.lights.class_pairs`.
    """
    for d in range(response.shape[0]):
        values = response[d]
        pair = 0
        for a in range(bounds.size - 1):
            for b in range(a + 1, bounds.size - 1):
                best = np.inf
                for i in range(bounds[a], bounds[a + 1]):
                    m0, m1, m2, m3 = values[0, i], values[1, i], values[2, i], values[3, i]
                    nearest = np.inf
                    for j in range(bounds[b], bounds[b + 1]):
                        x0, x1, x2, x3 = m0 - values[0, j], m1 - values[1, j], m2 - values[2, j], m3 - values[3, j]
                        squared = x0 * x0 + x1 * x1 + x2 * x2 + x3 * x3
                        nearest = smaller(nearest, squared)
                    best = smaller(best, nearest)
                out[d, pair] = best
                pair += 1


@njit(cache=True, nogil=True)
def nearest_pairs(response: FloatArray, order: IndexArray, bounds: IndexArray, out: IndexArray) -> None:
    """The two nearest signals of each pair of classes, over all cases; of equally near ones the first.

    `response`: C-ordered ndarray[n_designs, n_cases, n_signals, n_channels]; `order`: its signals, one class after the
    other; `bounds`: ndarray[n_classes + 1], where each class begins in `order`. `out`: ndarray[n_designs, n_pairs, 2],
    signals, pairs in the order of `curves.lights.class_pairs`; -1 where a distance is not finite.
    """
    for d in range(response.shape[0]):
        pair = 0
        for a in range(bounds.size - 1):
            for b in range(a + 1, bounds.size - 1):
                first, second = order[bounds[a] : bounds[a + 1]], order[bounds[b] : bounds[b + 1]]
                squared = _nearest_pair(response[d], first, second, False, out[d, pair])
                if not _LEAST_SQUARE < squared < _MOST_SQUARE:
                    farthest = _nearest_pair(response[d], first, second, True, out[d, pair])
                    if not farthest < np.inf:
                        out[d, pair] = -1
                pair += 1


@njit(cache=True, nogil=True)
def _nearest_pair(cases: FloatArray, first: IndexArray, second: IndexArray, legs: bool, out: IndexArray) -> float:
    """Put the two nearest signals into `out`; returns their squared distance, NaN or infinite where one of all is.

    `legs`: distances instead, without squares. `cases`: ndarray[n_cases, n_signals, n_channels].
    """
    best, odd = np.inf, 0.0
    for case in range(cases.shape[0]):
        for i in first:
            for j in second:
                total = 0.0
                for c in range(cases.shape[2]):
                    apart = cases[case, i, c] - cases[case, j, c]
                    total = math.hypot(total, apart) if legs else total + apart * apart
                if total < best:
                    best, out[0], out[1] = total, i, j
                odd += 0.0 * total
    return best + odd


@njit(cache=True, nogil=True)
def _lanes(
    values: FloatArray, order: IndexArray, first: int, lanes: FloatArray, doubt: FloatArray, bad: BoolArray
) -> None:
    """Put the designs from `first` on side by side, ndarray[n_signals, LANES].

    Lanes that are left over repeat the first. Values of a design that are not all finite become 0; `bad` says where.
    `doubt`: ndarray[LANES], room to work in.
    """
    n = min(LANES, values.shape[0] - first)
    doubt[:] = 0.0
    for s in range(order.size):
        signal = order[s]
        for lane in range(n):
            lanes[s, lane] = values[first + lane, signal]
        for lane in range(n, LANES):
            lanes[s, lane] = values[first, signal]
        for lane in range(LANES):
            doubt[lane] += 0.0 * lanes[s, lane]
    for lane in range(LANES):
        if doubt[lane] != 0.0:  # NaN: one of its values is not finite
            lanes[:, lane] = 0.0
            if lane < n:
                bad[first + lane] = True


@njit(cache=True, nogil=True, fastmath=_NUMBERS)
def _ranges(lanes: FloatArray, low: FloatArray, high: FloatArray) -> None:
    """Smallest and largest value of each signal over the lanes."""
    for s in range(lanes.shape[0]):
        least, most = lanes[s, 0], lanes[s, 0]
        for lane in range(LANES):
            least = smaller(least, lanes[s, lane])
            most = larger(most, lanes[s, lane])
        low[s], high[s] = least, most


@njit(cache=True, nogil=True, fastmath=_NUMBERS)
def bounds_of_pairs(
    fixed: FloatArray, first: IndexArray, second: IndexArray, low: Floats, high: Floats, bound: FloatArray
) -> tuple[int, int]:
    """Lower bound of each pair's squared distance in any lane, for as many as may be the nearest, and their number.

    Second, the pair whose upper bound is smallest. `fixed` is sorted.
    """
    lead, least = 0, np.inf
    for k in range(fixed.size):
        if fixed[k] >= least:
            return k, lead
        i, j = first[k], second[k]
        below, above = low[i] - high[j], low[j] - high[i]
        gap, most = larger(larger(below, above), 0.0), -smaller(below, above)
        bound[k] = fixed[k] + gap * gap
        far = fixed[k] + most * most
        if far < least:
            least, lead = far, k
    return fixed.size, lead


@njit(cache=True, nogil=True, fastmath=_NUMBERS)
def nearest_in_lanes(
    lanes: Floats, fixed: Floats, first: IndexArray, second: IndexArray, some: IndexArray, best: Floats
) -> None:
    """Take `some` pairs into account, four at a time; their number is a multiple of four."""
    for at in range(0, some.size, 4):
        a, b, c, d = some[at], some[at + 1], some[at + 2], some[at + 3]
        fixed_a, fixed_b, fixed_c, fixed_d = fixed[a], fixed[b], fixed[c], fixed[d]
        a1, b1, c1, d1 = first[a], first[b], first[c], first[d]
        a2, b2, c2, d2 = second[a], second[b], second[c], second[d]
        for lane in range(LANES):
            x = lanes[a1, lane] - lanes[a2, lane]
            y = lanes[b1, lane] - lanes[b2, lane]
            z = lanes[c1, lane] - lanes[c2, lane]
            w = lanes[d1, lane] - lanes[d2, lane]
            x = fixed_a + x * x
            y = fixed_b + y * y
            z = fixed_c + z * z
            w = fixed_d + w * w
            best[lane] = smaller(smaller(smaller(x, y), smaller(z, w)), best[lane])


@njit(cache=True, nogil=True)
def nearest_along_squared(
    values: FloatArray,
    order: IndexArray,
    fixed: FloatArray,
    first: IndexArray,
    second: IndexArray,
    starts: IndexArray,
    out: FloatArray,
    bad: BoolArray,
) -> int:
    """The same for designs that differ in one channel alone; how many distances were computed for all LANES designs.

    `values`: ndarray[n_designs, n_signals], that channel; `order`: its signals, one class after the other. `fixed`:
    squared distances in the other channels, sorted within each pair of classes; `first`, `second`: the signals of each,
    unsigned places in `order`; `starts`: where each pair of classes begins. `out`: ndarray[n_pairs, n_designs]; `bad`:
    ndarray[n_designs], set where a value is not finite: what `out` says of such a design means nothing.
    Designs are taken side by side, so that one instruction serves several; pairs that are the nearest in none of these
    designs, by the ranges of their values, are left out.
    """
    lanes, best, doubt = np.zeros((order.size, LANES)), np.empty(LANES), np.empty(LANES)
    low, high = np.empty(order.size), np.empty(order.size)
    most = 0
    for pair in range(starts.size - 1):
        most = max(most, starts[pair + 1] - starts[pair])
    bound, some = np.empty(most), np.empty(most + 3, np.intp)
    computed = 0
    for begin in range(0, values.shape[0], LANES):
        _lanes(values, order, begin, lanes, doubt, bad)
        _ranges(lanes, low, high)
        for pair in range(starts.size - 1):
            own = slice(starts[pair], starts[pair + 1])
            count, lead = bounds_of_pairs(fixed[own], first[own], second[own], low, high, bound)
            best[:] = np.inf
            some[:4] = lead
            nearest_in_lanes(lanes, fixed[own], first[own], second[own], some[:4], best)
            enough, left = best[0], 0
            for lane in range(1, LANES):
                enough = larger(enough, best[lane])
            for k in range(count):
                some[left] = k
                left += bound[k] < enough
            some[left : left + 3] = lead  # to a multiple of four
            nearest_in_lanes(lanes, fixed[own], first[own], second[own], some[: (left + 3) & ~3], best)
            computed += 4 + ((left + 3) & ~3)
            for lane in range(min(LANES, values.shape[0] - begin)):
                out[pair, begin + lane] = best[lane]
    return computed
