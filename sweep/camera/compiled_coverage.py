"""Compiled areas of a disc on squares. They release the GIL."""

from __future__ import annotations

import math

import numpy as np

from ..base.machine_code import njit
from ..base.types import FloatArray


@njit(cache=True, nogil=True)
def _area(x: float, y: float, radius: float) -> float:
    """Signed area of the disc over the rectangle from 0 to (x, y), odd in both."""
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
    """Share of a square of half side `half` around (x, y) that lies in the disc of `radius` around 0, exact."""
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
    """`covered_share` of squares, ndarray[n] each."""
    found = np.empty(x.size)
    for at in range(x.size):
        found[at] = covered_share(x[at], y[at], half, radius)
    return found


@njit(cache=True, nogil=True)
def covered_by_disc(x: FloatArray, y: FloatArray, half: float, radius: float) -> FloatArray:
    """How much of each pixel a disc covers, ndarray[n, n_rows, n_columns]; `x`: ndarray[n, n_columns], `y` likewise."""
    found = np.empty((len(x), y.shape[1], x.shape[1]))
    for case in range(len(x)):
        for row in range(y.shape[1]):
            for column in range(x.shape[1]):
                found[case, row, column] = covered_share(x[case, column], y[case, row], half, radius)
    return found
