"""Compiled inner loops of the law of a pixel: its pieces, and readings of lamps over their brightness.

They release the GIL.
"""

from __future__ import annotations

import math

import numpy as np

from ...base.machine_code import njit
from ...base.types import BoolArray, FloatArray, IndexArray

Lamps = tuple[
    FloatArray,
    FloatArray,
    IndexArray,
    FloatArray,
    FloatArray,
    IndexArray,
    FloatArray,
    FloatArray,
    FloatArray,
    FloatArray,
    FloatArray,
    FloatArray,
    FloatArray,
    IndexArray,
]
"""Electrons of each lamp in each pixel, and without lamps; the table of each; the law (see `law.Law`, its fields);
weights of the pixels in the mean of each channel and in its variance; the channel that a pixel is of, -1 for none and
the number of channels for several."""


@njit(cache=True, nogil=True)
def _is_near(i: int, j: int, nodes: FloatArray, values: FloatArray, slopes: FloatArray, near: FloatArray) -> bool:
    """Return whether the cubics through two nodes are near the values at all nodes between them."""
    width = nodes[j] - nodes[i]
    for row in range(2):
        first, last, rise = slopes[row, i], slopes[row, j], (values[row, j] - values[row, i]) / width
        square, cube = (3.0 * rise - 2.0 * first - last) / width, (first + last - 2.0 * rise) / width**2
        for k in range(i + 1, j):
            d = nodes[k] - nodes[i]
            if not abs(((cube * d + square) * d + first) * d + values[row, i] - values[row, k]) <= near[row, k]:
                return False
    return True


@njit(cache=True, nogil=True)
def needed_nodes(
    nodes: FloatArray, values: FloatArray, slopes: FloatArray, near: FloatArray, needed: BoolArray
) -> None:
    """Mark the nodes whose cubics are as `near` as asked to the values at the other nodes; both ends are needed."""
    at, last = 0, nodes.size - 1
    needed[0] = True
    while at < last:
        step = 1
        while at + 2 * step <= last and _is_near(at, at + 2 * step, nodes, values, slopes, near):
            step *= 2
        good, bad = at + step, min(at + 2 * step, last + 1)
        while bad - good > 1:
            middle = (good + bad) // 2
            if _is_near(at, middle, nodes, values, slopes, near):
                good = middle
            else:
                bad = middle
        at = good
        needed[at] = True


@njit(cache=True, nogil=True)
def read_at(a: float, lamp: int, lamps: Lamps, mean: FloatArray, variance: FloatArray, row: int) -> None:
    """Write mean and variance of the channels of a lamp of brightness a into a row."""
    lit, dark, tables, nodes, cubic, piece, step, ends, _, _, _, weights, squares, only = lamps
    n_channels = weights.shape[1]
    for c in range(n_channels):
        mean[row, c] = variance[row, c] = 0.0
    for p in range(only.size):
        if only[p] < 0:
            continue
        t = tables[lamp, p]
        e = lit[lamp, p] * a + dark[p]
        e = ends[t] if e > ends[t] else e
        e = 0.0 if e < 0.0 else e
        if math.isnan(e):
            mean[row], variance[row] = np.nan, np.nan
            return
        k = piece[t, int(math.sqrt(e) / step[t])]
        while nodes[t, k + 1] <= e and nodes[t, k + 1] < ends[t]:
            k += 1
        d = e - nodes[t, k]
        m = ((cubic[t, k, 3] * d + cubic[t, k, 2]) * d + cubic[t, k, 1]) * d + cubic[t, k, 0]
        v = max(((cubic[t, k, 7] * d + cubic[t, k, 6]) * d + cubic[t, k, 5]) * d + cubic[t, k, 4], 0.0)
        first = only[p] if only[p] < n_channels else 0
        for c in range(first, first + 1 if only[p] < n_channels else n_channels):
            mean[row, c] += weights[p, c] * m
            variance[row, c] += squares[p, c] * v


@njit(cache=True, nogil=True)
def read_lamps(lamps: Lamps, signals: IndexArray, factors: FloatArray, mean: FloatArray, variance: FloatArray) -> None:
    """Write mean and variance of the channels of some lamps, each at its own brightnesses, lamp by lamp."""
    for s in range(signals.size):
        for f in range(factors.shape[1]):
            read_at(factors[s, f], signals[s], lamps, mean, variance, s * factors.shape[1] + f)


@njit(cache=True, nogil=True)
def _slopes(cubic: FloatArray, t: int, k: int, first: int, low: float, high: float) -> tuple[float, float]:
    """Return the least and largest slope of a cubic between two places."""
    x1, x2, x3 = cubic[t, k, first + 1], 2.0 * cubic[t, k, first + 2], 3.0 * cubic[t, k, first + 3]
    one, two = (x3 * low + x2) * low + x1, (x3 * high + x2) * high + x1
    least, largest = min(one, two), max(one, two)
    if x3 != 0.0 and low < -0.5 * x2 / x3 < high:
        turn = x1 - 0.25 * x2 * x2 / x3
        least, largest = min(least, turn), max(largest, turn)
    return least, largest


@njit(cache=True, nogil=True)
def slopes_between(low: float, high: float, lamp: int, lamps: Lamps, slopes: FloatArray) -> None:
    """Write least and largest slope of the mean of each channel, and of its variance, between two brightnesses."""
    lit, dark, tables, nodes, cubic, piece, step, ends, hulls, _, _, weights, squares, only = lamps
    n_channels = weights.shape[1]
    slopes[:] = 0.0
    for p in range(only.size):
        if only[p] < 0:
            continue
        t, light = tables[lamp, p], lit[lamp, p]
        e, f = max(min(light * low + dark[p], ends[t]), 0.0), max(min(light * high + dark[p], ends[t]), 0.0)
        i = piece[t, int(math.sqrt(e) / step[t])]
        while nodes[t, i + 1] <= e and nodes[t, i + 1] < ends[t]:
            i += 1
        j = i
        if f >= nodes[t, i + 1]:
            j = max(piece[t, int(math.sqrt(f) / step[t])], i)
            while nodes[t, j + 1] <= f and nodes[t, j + 1] < ends[t]:
                j += 1
        level = 0
        while (2 << level) < j - i:
            level += 1
        first = only[p] if only[p] < n_channels else 0
        for row in range(2):
            s1, s2 = _slopes(cubic, t, i, 4 * row, e - nodes[t, i], (f if i == j else nodes[t, i + 1]) - nodes[t, i])
            if i < j:
                s3, s4 = _slopes(cubic, t, j, 4 * row, 0.0, f - nodes[t, j])
                s1, s2 = min(s1, s3), max(s2, s4)
            if i + 1 < j:  # whole pieces between, as two overlapping powers of 2 of them
                k = j - (1 << level)
                s1 = min(s1, hulls[t, 2 * row, level, i + 1], hulls[t, 2 * row, level, k])
                s2 = max(s2, hulls[t, 2 * row + 1, level, i + 1], hulls[t, 2 * row + 1, level, k])
            if light * high + dark[p] > ends[t]:
                s1, s2 = min(s1, 0.0), max(s2, 0.0)
            for c in range(first, first + 1 if only[p] < n_channels else n_channels):
                share = light * (squares[p, c] if row else weights[p, c])
                slopes[2 * row, c] += min(share * s1, share * s2)
                slopes[2 * row + 1, c] += max(share * s1, share * s2)


@njit(cache=True, nogil=True)
def largest_variances(lamps: Lamps, factors: FloatArray, most: FloatArray) -> None:
    """Write no less than the variance of the channels of all lamps up to each brightness."""
    lit, dark, tables, nodes, cubic, piece, step, ends, _, before, _, weights, squares, only = lamps
    for lamp in range(factors.shape[0]):
        for f in range(factors.shape[1]):
            for c in range(weights.shape[1]):
                most[lamp, f, c] = 0.0
            for p in range(only.size):
                t = tables[lamp, p]
                e = lit[lamp, p] * factors[lamp, f] + dark[p]
                if only[p] < 0 or not e >= 0.0:
                    continue
                e = min(e, ends[t])
                k = piece[t, int(math.sqrt(e) / step[t])]
                while nodes[t, k + 1] <= e and nodes[t, k + 1] < ends[t]:
                    k += 1
                d = e - nodes[t, k]
                v = ((cubic[t, k, 7] * d + cubic[t, k, 6]) * d + cubic[t, k, 5]) * d
                least, largest = _slopes(cubic, t, k, 4, 0.0, d)
                v = cubic[t, k, 4] + (v if least >= 0.0 else max(largest, 0.0) * d)
                v = max(v, before[t, k], 0.0)
                for c in range(weights.shape[1]):
                    most[lamp, f, c] += squares[p, c] * v


@njit(cache=True, nogil=True)
def values_and_slopes(
    electrons: FloatArray,
    nodes: FloatArray,
    cubic: FloatArray,
    piece: IndexArray,
    step: float,
    end: float,
    out: FloatArray,
) -> None:
    """Write mean and variance of a pixel at some electrons, then the slopes of both, as many as `out` has rows."""
    for at in range(electrons.size):
        e = electrons[at]
        if math.isnan(e):
            out[:, at] = np.nan
            continue
        full, e = e >= end, min(max(e, 0.0), end)
        k = piece[int(math.sqrt(e) / step)]
        while nodes[k + 1] <= e and nodes[k + 1] < end:
            k += 1
        d = e - nodes[k]
        for row in range(min(out.shape[0], 2)):
            x0, x1, x2, x3 = cubic[k, 4 * row], cubic[k, 4 * row + 1], cubic[k, 4 * row + 2], cubic[k, 4 * row + 3]
            out[row, at] = ((x3 * d + x2) * d + x1) * d + x0
            if out.shape[0] == 4:
                out[2 + row, at] = 0.0 if full else (3.0 * x3 * d + 2.0 * x2) * d + x1
        if out.shape[0] > 1 and out[1, at] < 0.0:
            out[1::2, at] = 0.0
