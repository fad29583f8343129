"""Compiled inner loop: the nearest two members of a population, over the shifts of two lights that occur together."""

from __future__ import annotations

import numpy as np

from ..base.machine_code import njit
from ..base.types import FloatArray, IndexArray

_FLAT = 1e-12
"""A triangle whose squared area is a smaller share of its sides' is taken for its sides."""


@njit(cache=True, nogil=True)
def _on_side(start: FloatArray, end: FloatArray) -> tuple[float, float]:
    """Return the squared distance of a line segment from the origin, and the position, 0 at `start` to 1."""
    slope, along = 0.0, 0.0
    for c in range(start.size):
        step = end[c] - start[c]
        slope += step * start[c]
        along += step * step
    at = 0.0 if along == 0.0 else min(max(-slope / along, 0.0), 1.0)
    squared = 0.0
    for c in range(start.size):
        value = start[c] + at * (end[c] - start[c])
        squared += value * value
    return squared, at


@njit(cache=True, nogil=True)
def _on_triangle(corners: FloatArray, weights: FloatArray) -> float:
    """Return the squared distance of a triangle from the origin; `weights` takes those of the nearest point."""
    best = np.inf
    for one in range(3):
        other = (one + 1) % 3
        squared, at = _on_side(corners[one], corners[other])
        if squared < best:
            best = squared
            weights[:] = 0.0
            weights[one] = 1 - at
            weights[other] += at
    a, b, c, p, q = 0.0, 0.0, 0.0, 0.0, 0.0
    for channel in range(corners.shape[1]):
        start = corners[0, channel]
        u, v = corners[1, channel] - start, corners[2, channel] - start
        a += u * u
        b += u * v
        c += v * v
        p -= u * start
        q -= v * start
    area = a * c - b * b
    if area <= _FLAT * a * c:
        return best
    s, t = (p * c - q * b) / area, (q * a - p * b) / area
    if s <= 0.0 or t <= 0.0 or s + t >= 1.0:
        return best
    inside = 0.0
    for channel in range(corners.shape[1]):
        start = corners[0, channel]
        value = start + s * (corners[1, channel] - start) + t * (corners[2, channel] - start)
        inside += value * value
    if inside < best:
        best = inside
        weights[0], weights[1], weights[2] = 1 - s - t, s, t
    return best


@njit(cache=True, nogil=True)
def _corner(response: FloatArray, one: int, other: int, share: FloatArray, corner: FloatArray) -> float:
    """Put the difference of two members into `corner`, and return its squared length."""
    squared = 0.0
    for c in range(corner.size):
        x = response[one, c] + share[0] * (response[one + 1, c] - response[one, c])
        y = response[other, c] + share[1] * (response[other + 1, c] - response[other, c])
        corner[c] = x - y
        squared += corner[c] ** 2
    return squared


@njit(cache=True, nogil=True)
def nearest_members(
    response: FloatArray,
    first: IndexArray,
    second: IndexArray,
    which: IndexArray,
    starts: IndexArray,
    cells: IndexArray,
    shares: FloatArray,
    part: IndexArray,
    alone: bool,
    out: FloatArray,
    at: IndexArray,
    where: FloatArray,
) -> None:
    """Compute the squared distance of the nearest members of each two lights, in each part of their region.

    Parameters
    ----------
    response : ndarray of shape (n_spectra, n_channels)
        Response to each spectrum.
    first, second : ndarray of int
        First spectrum of each light.
    which : ndarray of int, shape (n_first, n_second)
        Region of each two lights.
    starts : ndarray of int
        First triangle of each region, and the end.
    cells, shares, part : ndarray
        Triangles of the regions (see `ShiftRegion`), and the part of each.
    alone : bool
        Only the smallest of all distances is requested; others may be too large.
    out : ndarray of shape (n_first, n_second, n_parts)
        Squared distances; infinite where there are none.
    at, where : ndarray of shape (..., 2)
        Whole steps and shares of the two nearest members.
    """
    corners, weights = np.empty((3, response.shape[1])), np.empty(3)
    steps = np.empty(response.shape[0] - 1)
    for row in range(steps.size):
        squared = 0.0
        for c in range(response.shape[1]):
            squared += (response[row + 1, c] - response[row, c]) ** 2
        steps[row] = np.sqrt(squared)
    out[:] = np.inf
    least = np.inf
    for i in range(first.size):
        for j in range(second.size):
            region = which[i, j]
            for triangle in range(starts[region], starts[region + 1]):
                one, other = first[i] + cells[triangle, 0], second[j] + cells[triangle, 1]
                p = part[triangle]
                squared = _corner(response, one, other, shares[triangle, 0], corners[0])
                # No other point of the triangle is further from this corner than a step of each.
                left = np.sqrt(squared) - (steps[one] + steps[other])
                if left > 0.0 and left * left > (least if alone else out[i, j, p]):
                    continue
                for corner in range(1, 3):
                    _corner(response, one, other, shares[triangle, corner], corners[corner])
                nearest = _on_triangle(corners, weights)
                if nearest < out[i, j, p]:
                    out[i, j, p] = nearest
                    least = min(least, nearest)
                    for k in range(2):
                        at[i, j, p, k] = cells[triangle, k]
                        where[i, j, p, k] = 0.0
                        for corner in range(3):
                            where[i, j, p, k] += weights[corner] * shares[triangle, corner, k]
