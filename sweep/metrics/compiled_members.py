"""Compiled inner loop: the nearest two members of a population, over the shifts of two lights that occur together."""

from __future__ import annotations

import numpy as np

from ..base.machine_code import njit
from ..base.types import FloatArray, IndexArray

_FLAT = 1e-12
"""A triangle whose squared area is a smaller share of its sides' is taken for its sides."""


@njit(cache=True, nogil=True)
def _on_side(start: FloatArray, end: FloatArray) -> tuple[float, float]:
    """Squared distance of a straight line between two points from the origin, and where, 0 at `start` to 1."""
    slope, along = 0.0, 0.0
    for c in range(start.size):
        step = end[c] - start[c]
        slope += step * start[c]
        along += step * step
    at = 0.0 if along == 0.0 else min(max(-slope / along, 0.0), 1.0)
    found = 0.0
    for c in range(start.size):
        value = start[c] + at * (end[c] - start[c])
        found += value * value
    return found, at


@njit(cache=True, nogil=True)
def _on_triangle(corners: FloatArray, weights: FloatArray) -> float:
    """Squared distance of a triangle from the origin; `corners`: ndarray[3, n_channels].

    `weights`: ndarray[3], takes those of the corners in the nearest point.
    """
    best = np.inf
    for one in range(3):
        other = (one + 1) % 3
        found, at = _on_side(corners[one], corners[other])
        if found < best:
            best = found
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
    """Puts the difference of two members into `corner`, ndarray[n_channels]; its squared length."""
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
    """Squared distance of the nearest members of each two lights, in each part of their region.

    `response`: ndarray[n_spectra, n_channels]; `first`, `second`: where the spectra of each light begin. `which`:
    region of each two, ndarray[n_first, n_second]; `starts`: where the triangles of each region begin, and the end;
    `cells`, `shares`: those of a `ShiftRegion`; `part`: of each triangle. `alone`: only the smallest of all distances
    is wanted, others may be too large. `out`: ndarray[n_first, n_second, n_parts], infinite where there is nothing or
    it is not wanted; `at`, `where`: ndarray[..., 2], the whole steps and the shares above them of the two nearest
    members.
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
                found = _on_triangle(corners, weights)
                if found < out[i, j, p]:
                    out[i, j, p] = found
                    least = min(least, found)
                    for k in range(2):
                        at[i, j, p, k] = cells[triangle, k]
                        where[i, j, p, k] = 0.0
                        for corner in range(3):
                            where[i, j, p, k] += weights[corner] * shares[triangle, corner, k]
