"""Compiled inner loops of the share of pixels that a sharp disc covers in cells of places. They release the GIL."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from ..base.types import FloatArray, IndexArray
from .compiled_light import covered_share


class CellWeights(NamedTuple):
    """Weights of pixels in the readout over cells of places: the largest, the largest slope along a row and along a
    column, and how much of the slope's change is sudden; ndarray[n_cells, n_rows, n_columns] each.
    """

    high: FloatArray
    slope_x: FloatArray
    slope_y: FloatArray
    jump: FloatArray


@njit(cache=True, nogil=True)
def _overlap(y: float, half: float, reach: float) -> float:
    """Length of y - half..y + half that lies in -reach..reach."""
    return max(0.0, min(y + half, reach) - max(y - half, -reach))


@njit(cache=True, nogil=True)
def slope_of_disc(along: float, across: float, half: float, radius: float, h: float) -> tuple[float, float]:
    """Of the share of a pixel that a sharp disc covers, along one axis in a cell of half width `h`: the largest slope,
    and how much of its change is sudden.
    """
    across = abs(across)
    low_of_left = high_of_left = low_of_right = high_of_right = sudden = 0.0
    for side in (-half, half):
        edge = abs(along + side)
        longest = math.sqrt(max(radius**2 - max(edge - h, 0.0) ** 2, 0.0))
        shortest = math.sqrt(max(radius**2 - (edge + h) ** 2, 0.0))
        high, low = _overlap(max(across - h, 0.0), half, longest), _overlap(across + h, half, shortest)
        sudden += _overlap(across, half + h, longest) - _overlap(across, half + h, shortest)
        if side < 0:
            high_of_left, low_of_left = high, low
        else:
            high_of_right, low_of_right = high, low
    area = 4 * half**2
    return max(high_of_left - low_of_right, high_of_right - low_of_left) / area, sudden / area


@njit(cache=True, nogil=True)
def areas(
    x: FloatArray, y: FloatArray, channel: IndexArray, n_channels: int, half: float, radius: float, h: float
) -> tuple[CellWeights, FloatArray, FloatArray]:
    """Of a mean over a disc of `radius`; the sum of each channel's weights at the corners, ndarray[n_cells, 4,
    n_channels], and how far it may be in a cell from the interpolation of these, ndarray[n_cells, n_channels].

    `x`: ndarray[n_cells, n_columns], `y`: ndarray[n_cells, n_rows], pixels from the cells' centers.
    """
    n, rows, columns = len(x), y.shape[1], x.shape[1]
    high, slope_x, slope_y, jump = np.zeros((4, n, rows, columns))
    every_corner, jumps = np.zeros((n, 4, n_channels)), np.zeros((n, n_channels))
    for cell in range(n):
        corners = every_corner[cell]
        for row in range(rows):
            for column in range(columns):
                dx, dy, own = x[cell, column], y[cell, row], channel[row, column]
                nearest = math.hypot(max(abs(dx) - h - half, 0.0), max(abs(dy) - h - half, 0.0))
                if nearest >= radius:
                    continue
                if math.hypot(abs(dx) + h + half, abs(dy) + h + half) <= radius:
                    high[cell, row, column] = 1.0
                    for corner in range(4):
                        corners[corner, own] += 1.0
                    continue
                high[cell, row, column] = covered_share(max(abs(dx) - h, 0.0), max(abs(dy) - h, 0.0), half, radius)
                slope_x[cell, row, column], one = slope_of_disc(dx, dy, half, radius, h)
                slope_y[cell, row, column], other = slope_of_disc(dy, dx, half, radius, h)
                jump[cell, row, column] = one + other
                jumps[cell, own] += (one + other) * h / 2
                for corner in range(4):
                    to_x, to_y = h * (2 * (corner % 2) - 1), h * (2 * (corner // 2) - 1)
                    corners[corner, own] += covered_share(dx - to_x, dy - to_y, half, radius)
    return CellWeights(high, slope_x, slope_y, jump), every_corner, jumps
