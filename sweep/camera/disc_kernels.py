"""Compiled inner loops of a disc: its area on squares, and means of a spline over squares. They release the GIL."""

from __future__ import annotations

import math

import numpy as np

from ..base.machine_code import njit
from ..base.types import FloatArray


@njit(cache=True, nogil=True)
def _area(x: float, y: float, radius: float) -> float:
    """Return the signed area of the disc over the rectangle from 0 to (x, y), odd in both."""
    sign = np.sign(x) * np.sign(y)
    x, y = min(abs(x), radius), min(abs(y), radius)
    corner = math.sqrt((radius - y) * (radius + y))  # from here on the circle is lower than y
    if x <= corner:
        return float(sign * x * y)
    height = math.sqrt((radius - x) * (radius + x))
    sector = radius**2 * math.atan2(x * y - corner * height, height * y + x * corner)
    return float(sign * 0.5 * (corner * y + x * height + sector))


@njit(cache=True, nogil=True)
def covered_share(x: float, y: float, half: float, radius: float) -> float:
    """Return the exact share of a square that lies in a disc around the origin, 0 to 1.

    All lengths are in one unit.
    """
    x, y, squared = abs(x), abs(y), radius * radius
    if (x + half) * (x + half) + (y + half) * (y + half) <= squared:
        return 1.0
    near_x, near_y = max(x - half, 0.0), max(y - half, 0.0)
    if near_x * near_x + near_y * near_y >= squared:
        return 0.0
    area = _area(x + half, y + half, radius) - _area(x + half, y - half, radius)
    area += _area(x - half, y - half, radius) - _area(x - half, y + half, radius)
    return min(max(area / (4 * half**2), 0.0), 1.0)


@njit(cache=True, nogil=True)
def covered_shares(x: FloatArray, y: FloatArray, half: float, radius: float) -> FloatArray:
    """Return `covered_share` of many squares, 0 to 1."""
    shares = np.empty(x.size)
    for at in range(x.size):
        shares[at] = covered_share(x[at], y[at], half, radius)
    return shares


@njit(cache=True, nogil=True)
def covered_by_disc(x: FloatArray, y: FloatArray, half: float, radius: float) -> FloatArray:
    """Return the share of each pixel in a disc, 0 to 1.

    `half`: half of the side of a pixel.
    """
    shares = np.empty((len(x), y.shape[1], x.shape[1]))
    for case in range(len(x)):
        for row in range(y.shape[1]):
            for column in range(x.shape[1]):
                shares[case, row, column] = covered_share(x[case, column], y[case, row], half, radius)
    return shares


@njit(cache=True, nogil=True)
def _basis(x: float, first: int, knots: FloatArray, result: FloatArray) -> None:
    """Put the four nonzero cubic B-splines between `knots[first]` and the next knot into `result`."""
    result[0] = 1.0
    for order in range(1, 4):
        saved = 0.0
        for at in range(order):
            right, left = knots[first + at + 1], knots[first + at + 1 - order]
            part = result[at] / (right - left)
            result[at] = saved + (right - x) * part
            saved = (x - left) * part
        result[order] = saved


@njit(cache=True, nogil=True)
def _inner_basis(t: float, result: FloatArray) -> None:
    """Put the four B-splines between equidistant knots into `result`, at a share `t` of the way to the next knot."""
    s = 1.0 - t
    result[0] = s * s * s / 6
    result[1] = (1 + s * (3 + s * (3 - 3 * s))) / 6
    result[2] = (1 + t * (3 + t * (3 - 3 * t))) / 6
    result[3] = t * t * t / 6


@njit(cache=True, nogil=True, fastmath={"contract"})
def _add_four(shares: FloatArray, coefficients: FloatArray, result: FloatArray) -> None:
    """Add up to four rows of coefficients, times their shares."""
    if len(coefficients) < 4:
        for node in range(len(coefficients)):
            for value in range(result.size):
                result[value] += shares[node] * coefficients[node, value]
        return
    a, b, c, d = shares[0], shares[1], shares[2], shares[3]
    first, second, third, fourth = coefficients[0], coefficients[1], coefficients[2], coefficients[3]
    for value in range(result.size):
        result[value] += (a * first[value] + b * second[value]) + (c * third[value] + d * fourth[value])


@njit(cache=True, nogil=True, fastmath={"contract"})
def means_of_cubic(
    places: FloatArray,
    nodes: FloatArray,
    weights: FloatArray,
    knots: FloatArray,
    coefficients: FloatArray,
    out: FloatArray,
) -> None:
    """Compute means over squares of a spline in the distance from the origin, by one rule along both sides.

    The weights go to the spline's coefficients first, so that no more is done for each function than one product. That
    takes less than a third of the time of SciPy's `BSpline.design_matrix` and a sixth of that of calling the spline.
    Each square is summed by itself: the same values in whatever company it is asked for.

    `nodes`, `weights`: nodes from the center, and weights that add up to 1.
    """
    last, per_unit = len(coefficients) - 1, 1 / (knots[5] - knots[4])
    four, folded = np.empty(4), np.zeros(len(coefficients))
    for place in range(len(places)):
        low, high = last, 3
        for i in range(nodes.size):
            squared = (places[place, 0] + nodes[i]) ** 2
            for j in range(nodes.size):
                x = math.sqrt(squared + (places[place, 1] + nodes[j]) ** 2)
                first = min(max(int((x - knots[0]) * per_unit) + 2, 3), last)
                if 6 <= first <= last - 3:
                    _inner_basis((x - knots[first]) * per_unit, four)
                else:
                    _basis(x, first, knots, four)
                for part in range(4):
                    folded[first - 3 + part] += weights[i] * weights[j] * four[part]
                low, high = min(low, first), max(high, first)
        out[place] = 0.0
        for node in range(low - 3, high + 1, 4):
            _add_four(folded[node : node + 4], coefficients[node : node + 4], out[place])
        folded[low - 3 : high + 1] = 0.0
