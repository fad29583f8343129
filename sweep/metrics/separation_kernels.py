"""Compiled inner loops: distances of pairs, without an array per step.

NumPy writes every difference of every pair to memory; these keep them in registers and skip pairs that cannot be the
nearest. They release the GIL. Sums keep their order, so results equal those of the same sums in NumPy.
"""

from __future__ import annotations

import math

import numpy as np

from ..base.lane_kernels import larger, smaller
from ..base.machine_code import njit
from ..base.types import FloatArray, IndexArray

_NUMBERS = {"nnan", "nsz"}
"""Lets the compiler compare several numbers at once; the result for NaN is undefined."""
_LANES, _AT_ONCE = 64, 16
"""Designs side by side, and pairs between two looks at whether the rest may be left out."""


@njit(cache=True, nogil=True, fastmath=_NUMBERS)
def nearest_squared(response: FloatArray, bounds: IndexArray, out: FloatArray) -> None:
    """Compute the smallest squared distance of each pair of classes.

    `response`: C-ordered and finite, one class after the other; missing channels are 0. `out` is in the order of
    `spectra.lights.class_pairs`.
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


@njit(cache=True, nogil=True, fastmath=_NUMBERS)
def nearest_chromatic_squared(response: FloatArray, bounds: IndexArray, out: FloatArray) -> None:
    """Compute the smallest squared chromatic distance of each pair of classes (see `chromatic.squared_distance`).

    `response`: less the response without lamps, C-ordered and finite, one class after the other; missing channels are
    0. `out` is in the order of `spectra.lights.class_pairs`.
    """
    for d in range(response.shape[0]):
        values = response[d]
        lengths = values[0] * values[0] + values[1] * values[1] + values[2] * values[2] + values[3] * values[3]
        pair = 0
        for a in range(bounds.size - 1):
            for b in range(a + 1, bounds.size - 1):
                best = np.inf
                for i in range(bounds[a], bounds[a + 1]):
                    m0, m1, m2, m3, length = values[0, i], values[1, i], values[2, i], values[3, i], lengths[i]
                    nearest = np.inf
                    for j in range(bounds[b], bounds[b + 1]):
                        x0, x1, x2, x3 = values[0, j], values[1, j], values[2, j], values[3, j]
                        a01, a02, a03 = m0 * x1 - m1 * x0, m0 * x2 - m2 * x0, m0 * x3 - m3 * x0
                        a12, a13, a23 = m1 * x2 - m2 * x1, m1 * x3 - m3 * x1, m2 * x3 - m3 * x2
                        area = a01 * a01 + a02 * a02 + a03 * a03 + a12 * a12 + a13 * a13 + a23 * a23
                        larger_length = larger(length, lengths[j])
                        squared = area / larger_length if larger_length > 0.0 else 0.0
                        if m0 * x0 + m1 * x1 + m2 * x2 + m3 * x3 <= 0.0:
                            squared = smaller(length, lengths[j])
                        nearest = smaller(nearest, squared)
                    best = smaller(best, nearest)
                out[d, pair] = best
                pair += 1


@njit(cache=True, nogil=True)
def nearest_scaled(response: FloatArray, first: IndexArray, second: IndexArray, out: FloatArray) -> None:
    """Compute the smallest distance of two types whose squares a float does not hold; NaN if any difference is.

    Differences are scaled by a power of two, which is exact.
    """
    for d in range(response.shape[0]):
        best = np.inf
        for i in first:
            for j in second:
                largest = 0.0
                for c in range(response.shape[2]):
                    difference = abs(response[d, i, c] - response[d, j, c])
                    largest = largest if difference <= largest else difference
                    best = difference if np.isnan(difference) else best
                if largest < best:
                    best = min(best, _scaled_length(response[d, i], response[d, j], largest))
        out[d] = best


@njit(cache=True, nogil=True)
def _scaled_length(one: FloatArray, other: FloatArray, largest: float) -> float:
    if largest == 0.0 or np.isinf(largest):
        return largest
    exponent, total = math.frexp(largest)[1], 0.0
    for c in range(one.size):
        total += math.ldexp(one[c] - other[c], -exponent) ** 2
    return math.ldexp(math.sqrt(total), exponent)


@njit(cache=True, nogil=True)
def nearest_pairs(response: FloatArray, order: IndexArray, bounds: IndexArray, out: IndexArray) -> None:
    """Find the two nearest signals of each pair of classes over all cases; of equally near ones the first.

    `out`: signals, in the order of `spectra.lights.class_pairs`; -1 where a distance is not finite.
    """
    for d in range(response.shape[0]):
        pair = 0
        for a in range(bounds.size - 1):
            for b in range(a + 1, bounds.size - 1):
                best, odd = np.inf, 0.0
                for case in range(response.shape[1]):
                    for i in order[bounds[a] : bounds[a + 1]]:
                        for j in order[bounds[b] : bounds[b + 1]]:
                            total = 0.0
                            for c in range(response.shape[3]):
                                difference = response[d, case, i, c] - response[d, case, j, c]
                                total += difference * difference
                            if total < best:
                                best = total
                                out[d, pair, 0], out[d, pair, 1] = i, j
                            odd += 0.0 * total
                if not best + odd < np.inf:
                    out[d, pair] = -1
                pair += 1


@njit(cache=True, nogil=True, fastmath=_NUMBERS)
def nearest_along_squared(
    values: FloatArray, fixed: FloatArray, first: IndexArray, second: IndexArray, starts: IndexArray, out: FloatArray
) -> None:
    """Compute the smallest squared distance of each pair of classes for designs that differ in one channel alone.

    `fixed`: squared distances in the other channels, ascending within each pair of classes; `out`: squared distances;
    undefined for values that are not finite.
    """
    for begin in range(0, len(values), _LANES):  # designs side by side, so that one instruction serves several
        block = np.ascontiguousarray(values[begin : begin + _LANES].T)
        for pair in range(starts.size - 1):
            best = np.full(block.shape[1], np.inf)
            for start in range(starts[pair], starts[pair + 1], _AT_ONCE):
                if fixed[start] >= best.max():
                    break
                for k in range(start, min(start + _AT_ONCE, starts[pair + 1])):
                    fixed_square, first_values, second_values = fixed[k], block[first[k]], block[second[k]]
                    for d in range(best.size):
                        x = first_values[d] - second_values[d]
                        best[d] = smaller(best[d], fixed_square + x * x)
            out[pair, begin : begin + _LANES] = best


@njit(cache=True, nogil=True, fastmath=_NUMBERS)
def nearest_chromatic_along(
    values: FloatArray,
    dark: FloatArray,
    others: FloatArray,
    first: IndexArray,
    second: IndexArray,
    starts: IndexArray,
    least: FloatArray,
    out: FloatArray,
) -> None:
    """As `nearest_along_squared`, of the chromatic distance (see `chromatic.squared_distance`).

    `dark`: the channel without lamps; `others`: the three shared channels less their response without lamps, missing
    ones 0; `least`: what no squared distance of a pair is below. Ratios are compared without a division.
    """
    own = others[:, 0] ** 2 + others[:, 1] ** 2 + others[:, 2] ** 2
    for begin in range(0, len(values), _LANES):
        block = np.ascontiguousarray(values[begin : begin + _LANES].T)
        n = block.shape[1]
        length, negative = np.empty_like(block), 0.0
        for signal in range(block.shape[0]):
            for d in range(n):
                lit = block[signal, d] - dark[begin + d]
                negative = smaller(negative, lit)
                block[signal, d] = lit
                length[signal, d] = own[signal] + lit * lit
        for pair in range(starts.size - 1):
            top, under = np.full(n, np.inf), np.ones(n)
            for start in range(starts[pair], starts[pair + 1], _AT_ONCE):
                worst = 0.0
                for d in range(n):
                    worst = larger(worst, top[d] / under[d])
                if least[start] >= worst:
                    break
                for k in range(start, min(start + _AT_ONCE, starts[pair + 1])):
                    i, j = first[k], second[k]
                    one, other, squared_1, squared_2 = block[i], block[j], length[i], length[j]
                    f0, f1, f2 = others[i, 0], others[i, 1], others[i, 2]
                    g0, g1, g2 = others[j, 0], others[j, 1], others[j, 2]
                    a01, a02, a12 = f0 * g1 - f1 * g0, f0 * g2 - f2 * g0, f1 * g2 - f2 * g1
                    area, dot = a01 * a01 + a02 * a02 + a12 * a12, f0 * g0 + f1 * g1 + f2 * g2
                    usual = dot > 0.0 and negative >= 0.0  # angles below 90 degrees, lengths above 0
                    for d in range(n):
                        x, y = one[d], other[d]
                        x0, x1, x2 = f0 * y - g0 * x, f1 * y - g1 * x, f2 * y - g2 * x
                        squared, most = area + x0 * x0 + x1 * x1 + x2 * x2, larger(squared_1[d], squared_2[d])
                        if not usual:
                            squared = squared_1[d] * squared_2[d] if dot + x * y <= 0.0 else squared
                            most = most if most > 0.0 else 1.0
                        nearer = squared * under[d] < top[d] * most
                        top[d] = squared if nearer else top[d]
                        under[d] = most if nearer else under[d]
            for d in range(n):
                out[pair, begin + d] = top[d] / under[d]
