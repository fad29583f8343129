"""Compiled inner loop of sums over a cubic spline. It releases the GIL."""

from __future__ import annotations

import numpy as np

from ..base.machine_code import njit
from ..base.types import FloatArray


@njit(cache=True, nogil=True)
def _basis(x: float, first: int, knots: FloatArray, found: FloatArray) -> None:
    """Put the four cubic B-splines that are not 0 between `knots[first]` and the next one into `found`."""
    found[0] = 1.0
    for order in range(1, 4):
        saved = 0.0
        for at in range(order):
            right, left = knots[first + at + 1], knots[first + at + 1 - order]
            part = found[at] / (right - left)
            found[at] = saved + (right - x) * part
            saved = (x - left) * part
        found[order] = saved


@njit(cache=True, nogil=True)
def _inner_basis(t: float, found: FloatArray) -> None:
    """`_basis` where all knots around are equidistant, at a share `t` of the way to the next one."""
    s = 1.0 - t
    found[0] = s * s * s / 6
    found[1] = (1 + s * (3 + s * (3 - 3 * s))) / 6
    found[2] = (1 + t * (3 + t * (3 - 3 * t))) / 6
    found[3] = t * t * t / 6


@njit(cache=True, nogil=True, fastmath={"contract"})
def _add_four(shares: FloatArray, coefficients: FloatArray, found: FloatArray) -> None:
    """Add up to four rows of coefficients, ndarray[n, n_values], times their shares."""
    if len(coefficients) < 4:
        for node in range(len(coefficients)):
            for value in range(found.size):
                found[value] += shares[node] * coefficients[node, value]
        return
    a, b, c, d = shares[0], shares[1], shares[2], shares[3]
    one, two, three, four = coefficients[0], coefficients[1], coefficients[2], coefficients[3]
    for value in range(found.size):
        found[value] += (a * one[value] + b * two[value]) + (c * three[value] + d * four[value])


@njit(cache=True, nogil=True, fastmath={"contract"})
def sums_of_cubic(
    x: FloatArray, weights: FloatArray, knots: FloatArray, coefficients: FloatArray, out: FloatArray
) -> None:
    """Sums of a spline's values over the last axis of `x`, ndarray[n, m], by their weights, ndarray[m].

    `knots`: from 0 on, equidistant but for the second and the last but one, which a spline that is not a knot there
    leaves out; `coefficients`: ndarray[n_knots - 4, n_values]; `out`: ndarray[n, n_values]. Beyond the end the last
    piece goes on. Each row is summed by itself: the same values in whatever company it is asked for.
    """
    last, per_unit = len(coefficients) - 1, 1 / (knots[5] - knots[4])
    four, folded = np.empty(4), np.zeros(len(coefficients))
    for row in range(len(x)):
        low, high = last, 3
        for at in range(weights.size):
            first = min(max(int(x[row, at] * per_unit) + 2, 3), last)
            if 6 <= first <= last - 3:
                _inner_basis((x[row, at] - knots[first]) * per_unit, four)
            else:
                _basis(x[row, at], first, knots, four)
            for part in range(4):
                folded[first - 3 + part] += weights[at] * four[part]
            low, high = min(low, first), max(high, first)
        out[row] = 0.0
        for node in range(low - 3, high + 1, 4):
            _add_four(folded[node : node + 4], coefficients[node : node + 4], out[row])
        folded[low - 3 : high + 1] = 0.0


@njit(cache=True, nogil=True, fastmath={"contract"})
def solve_banded(band: FloatArray, values: FloatArray) -> None:
    """Solve a system of equations whose matrix has a band and needs no exchange of rows; both are overwritten.

    `band`: ndarray[n, 2 w + 1], the diagonal in the middle; `values`: ndarray[n, n_functions], then the solution.
    """
    n, w = len(band), band.shape[1] // 2
    for row in range(n):
        for below in range(1, min(w, n - 1 - row) + 1):
            share = band[row + below, w - below] / band[row, w]
            if share != 0:
                for at in range(1, w + 1):
                    band[row + below, w - below + at] -= share * band[row, w + at]
                for k in range(values.shape[1]):
                    values[row + below, k] -= share * values[row, k]
    for row in range(n - 1, -1, -1):
        for beyond in range(1, min(w, n - 1 - row) + 1):
            share = band[row, w + beyond]
            if share != 0:
                for k in range(values.shape[1]):
                    values[row, k] -= share * values[row + beyond, k]
        scale = 1 / band[row, w]
        for k in range(values.shape[1]):
            values[row, k] *= scale
