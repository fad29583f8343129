"""Compiled inner loop: the nearest members of each two lights, over all shifts that occur together."""

from __future__ import annotations

import numpy as np

from ..base.machine_code import njit
from ..base.types import FloatArray, IndexArray

_DEGENERATE = 1e-12
"""Relative Gram determinant, sin^2 of the angle between two edges, up to which a triangle counts as its edges alone."""


@njit(cache=True, nogil=True)
def _nearest_on_segment(start: FloatArray, end: FloatArray) -> tuple[float, float]:
    """Return the squared distance from the origin to a segment, and the nearest position, 0 (start) to 1 (end)."""
    projection, length_squared = 0.0, 0.0
    for channel in range(start.size):
        step = end[channel] - start[channel]
        projection += step * start[channel]
        length_squared += step * step
    position = 0.0 if length_squared == 0.0 else min(max(-projection / length_squared, 0.0), 1.0)
    squared = 0.0
    for channel in range(start.size):
        value = start[channel] + position * (end[channel] - start[channel])
        squared += value * value
    return squared, position


@njit(cache=True, nogil=True)
def _nearest_on_triangle(corners: FloatArray, weights: FloatArray) -> float:
    """Return the squared distance from the origin to a triangle.

    The barycentric coordinates of the nearest point are written to `weights`. `corners`: (3, n_channels).
    """
    best = np.inf
    for start in range(3):
        end = (start + 1) % 3
        squared, position = _nearest_on_segment(corners[start], corners[end])
        if squared < best:
            best = squared
            weights[:] = 0.0
            weights[start] = 1 - position
            weights[end] += position
    # Least squares in the plane of the triangle: minimize |corner 0 + s u + t v|, with the edges u and v.
    uu, uv, vv, u_rhs, v_rhs = 0.0, 0.0, 0.0, 0.0, 0.0
    for channel in range(corners.shape[1]):
        origin = corners[0, channel]
        u, v = corners[1, channel] - origin, corners[2, channel] - origin
        uu += u * u
        uv += u * v
        vv += v * v
        u_rhs -= u * origin
        v_rhs -= v * origin
    determinant = uu * vv - uv * uv
    if determinant <= _DEGENERATE * uu * vv:
        return best
    s, t = (u_rhs * vv - v_rhs * uv) / determinant, (v_rhs * uu - u_rhs * uv) / determinant
    if s <= 0.0 or t <= 0.0 or s + t >= 1.0:
        return best
    interior = 0.0
    for channel in range(corners.shape[1]):
        origin = corners[0, channel]
        value = origin + s * (corners[1, channel] - origin) + t * (corners[2, channel] - origin)
        interior += value * value
    if interior < best:
        best = interior
        weights[0], weights[1], weights[2] = 1 - s - t, s, t
    return best


@njit(cache=True, nogil=True)
def _member_difference(
    response: FloatArray, first_row: int, second_row: int, shares: FloatArray, difference: FloatArray
) -> float:
    """Write the response of one member minus that of the other to `difference`, and return its squared norm.

    A member lies between a row of `response` and the next row, at its share of the step: `shares` has shape (2,).
    """
    squared = 0.0
    for channel in range(difference.size):
        x = response[first_row, channel]
        x += shares[0] * (response[first_row + 1, channel] - response[first_row, channel])
        y = response[second_row, channel]
        y += shares[1] * (response[second_row + 1, channel] - response[second_row, channel])
        difference[channel] = x - y
        squared += difference[channel] ** 2
    return squared


@njit(cache=True, nogil=True)
def nearest_members(
    response: FloatArray,
    first_rows: IndexArray,
    second_rows: IndexArray,
    region_of_pair: IndexArray,
    region_starts: IndexArray,
    cells: IndexArray,
    shares: FloatArray,
    parts: IndexArray,
    smallest_only: bool,
    out_squared: FloatArray,
    out_steps: IndexArray,
    out_shares: FloatArray,
) -> None:
    """Compute the squared distance of the nearest members of each two lights, in each part of their region.

    A light is a signal of one spectral width. A member is this light at one shift of its spectrum; its response is
    interpolated between two whole steps of the wavelength grid. A region holds the pairs of shifts that two lights
    can have together, cut into triangles; the parts of a region divide it along its length.

    `response`: response to each spectrum, DN; consecutive rows of a light are one step apart; `cells`: whole steps of
    both lights below each triangle (see `ShiftRegion`); `shares`: corners of each triangle above these steps, 0 to 1;
    `out_squared`: output: squared distances, DN^2; infinite where a part has no triangle or all of its triangles were
    skipped. With `smallest_only` triangles are skipped that cannot hold the smallest of all distances; other results
    may then be too large.
    """
    corners, weights = np.empty((3, response.shape[1])), np.empty(3)
    step_lengths = np.empty(response.shape[0] - 1)
    for row in range(step_lengths.size):
        squared = 0.0
        for channel in range(response.shape[1]):
            squared += (response[row + 1, channel] - response[row, channel]) ** 2
        step_lengths[row] = np.sqrt(squared)
    out_squared[:] = np.inf
    smallest = np.inf
    for i in range(first_rows.size):
        for j in range(second_rows.size):
            region = region_of_pair[i, j]
            for triangle in range(region_starts[region], region_starts[region + 1]):
                first_row, second_row = first_rows[i] + cells[triangle, 0], second_rows[j] + cells[triangle, 1]
                part = parts[triangle]
                squared = _member_difference(response, first_row, second_row, shares[triangle, 0], corners[0])
                # Within a triangle each member moves by at most one step, so this bounds all distances from below.
                lower_bound = np.sqrt(squared) - (step_lengths[first_row] + step_lengths[second_row])
                best = smallest if smallest_only else out_squared[i, j, part]
                if lower_bound > 0.0 and lower_bound * lower_bound > best:
                    continue
                for corner in range(1, 3):
                    _member_difference(response, first_row, second_row, shares[triangle, corner], corners[corner])
                squared = _nearest_on_triangle(corners, weights)
                if squared < out_squared[i, j, part]:
                    out_squared[i, j, part] = squared
                    smallest = min(smallest, squared)
                    for side in range(2):
                        out_steps[i, j, part, side] = cells[triangle, side]
                        out_shares[i, j, part, side] = 0.0
                        for corner in range(3):
                            out_shares[i, j, part, side] += weights[corner] * shares[triangle, corner, side]
