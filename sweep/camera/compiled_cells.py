"""Compiled inner loops of the bounds on what lies between places. They release the GIL."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from ..base.types import BoolArray, FloatArray, IndexArray
from .compiled_areas import CellWeights, slope_of_disc
from .compiled_light import add, covered_share

SEGMENTS = 8
"""Parts of a pixel's edge over which the image's slope is bounded one by one."""


class Envelopes(NamedTuple):
    """Of parts of a blurred image, as functions of the radius: no value from a radius on is above, none up to it below,
    and no slope near it is steeper; ndarray[n_radii, n_parts] each. `per_px`: radii per pixel. A sharp image has none.
    """

    above: FloatArray
    below: FloatArray
    steep: FloatArray
    per_px: float


_NONE = np.empty((0, 1))
SHARP = Envelopes(_NONE, _NONE, _NONE, 0.0)


@njit(cache=True, nogil=True)
def _node(r: float, images: Envelopes) -> int:
    """The node nearest to a radius."""
    return int(min(r * images.per_px + 0.5, images.steep.shape[0] - 1.0))


@njit(cache=True, nogil=True, fastmath={"contract"})
def _bend_of_edge(away: float, middle: float, half: float, h: float, images: Envelopes, found: FloatArray) -> None:
    """Put how fast the light that flows through an edge may change its slope into `found`, by part.

    The edge is `away` from the light's center and `half` to both sides of `middle` long.
    """
    piece = 2 * half / SEGMENTS
    edge = abs(away)
    near = max(edge - h, 0.0)
    found[:] = 0.0
    for segment in range(SEGMENTS):
        across = abs(middle + (segment + 0.5) * piece - half)
        low = max(across - piece / 2 - h, 0.0)
        low_r = math.sqrt(near * near + low * low)
        towards = min(1.0, (edge + h) / max(low_r, 1e-9))
        steep = images.steep[_node(math.sqrt(edge * edge + across * across), images)]
        for part in range(found.size):
            found[part] += steep[part] * towards


@njit(cache=True, nogil=True)
def _slope_between_edges(
    along: float, middle: float, half: float, h: float, images: Envelopes, found: FloatArray
) -> None:
    """Put the largest slope along one axis of a pixel's light over a cell into `found`, by part."""
    piece = 2 * half / SEGMENTS
    left, right = abs(along - half), abs(along + half)
    found[:] = 0.0
    for segment in range(SEGMENTS):
        # Of this piece of both edges, wherever the light is in the cell: nearest and furthest radius.
        away = abs(middle + (segment + 0.5) * piece - half)
        low, high = max(away - piece / 2 - h, 0.0), away + piece / 2 + h
        nodes = (
            _node(math.sqrt(max(left - h, 0.0) ** 2 + low * low), images),
            _node(math.sqrt((left + h) ** 2 + high * high), images),
            _node(math.sqrt(max(right - h, 0.0) ** 2 + low * low), images),
            _node(math.sqrt((right + h) ** 2 + high * high), images),
        )
        above_left, below_left = images.above[nodes[0]], images.below[nodes[1]]
        above_right, below_right = images.above[nodes[2]], images.below[nodes[3]]
        for part in range(found.size):
            found[part] += max(above_left[part] - below_right[part], above_right[part] - below_left[part])
    for part in range(found.size):
        found[part] /= SEGMENTS * 2 * half


@njit(cache=True, nogil=True)
def _bends_of_pixels(
    x: FloatArray, y: FloatArray, wanted: BoolArray, half: float, h: float, images: Envelopes, found: FloatArray
) -> None:
    """How far the light of pixels may be from the line between two ends of a cell, ndarray[n_rows, n_columns, n_parts].

    Pixels that touch share their edges.
    """
    touch = half == 0.5
    rows, columns = wanted.shape
    scale = h**2 / 2 / (SEGMENTS * 2 * half)
    flow = np.empty(found.shape[2])
    found[:] = 0.0
    for row in range(rows):
        for column in range(columns):
            if not wanted[row, column]:
                continue
            for turned in (False, True):
                along, across = (y[row], x[column]) if turned else (x[column], y[row])
                for side in (-1, 1):
                    to_row, to_column = (row + side, column) if turned else (row, column + side)
                    inside = 0 <= to_row < rows and 0 <= to_column < columns
                    shared = touch and inside and wanted[to_row, to_column]
                    if shared and side < 0:
                        continue
                    _bend_of_edge(along + side * half, across, half, h, images, flow)
                    for part in range(flow.size):
                        found[row, column, part] += scale * flow[part]
                    if shared:
                        for part in range(flow.size):
                            found[to_row, to_column, part] += scale * flow[part]


@njit(cache=True, nogil=True)
def _mixed(values: FloatArray, channel: IndexArray, row: int, column: int, share: float, found: FloatArray) -> bool:
    """Put what of a pixel's light is in each channel's value into `found`, neighbors' weights, too; whether any is."""
    found[:] = 0.0
    found[channel[row, column]] += (1 - share) * values[row, column]
    if share > 0:
        rows, columns = values.shape
        for to_row, to_column in ((row - 1, column), (row + 1, column), (row, column - 1), (row, column + 1)):
            if 0 <= to_row < rows and 0 <= to_column < columns:
                found[channel[to_row, to_column]] += share / 4 * values[to_row, to_column]
    some = False
    for value in found:
        some = some or value > 0
    return some


class Light(NamedTuple):
    """What is known of the light of a cell's pixels. `images`: of a blurred light; a sharp one is a disc of `radius`.

    `half`: of a pixel's side; `share`: of its light that comes through its neighbors' filters. `taken`: what a pixel
    of each channel takes of the light through each channel's filter, ndarray[n_channels, n_channels].
    """

    images: Envelopes
    half: float
    radius: float
    share: float
    taken: FloatArray


@njit(cache=True, nogil=True)
def _light_in_cell(dx: float, dy: float, h: float, light: Light, slopes: FloatArray, seen: FloatArray) -> None:
    """Put slopes and range of a pixel's light over a cell into these, ndarray[2, n_parts] each."""
    half, images = light.half, light.images
    ax, ay = abs(dx), abs(dy)
    if not images.steep.shape[0]:
        slopes[0, 0], _ = slope_of_disc(dx, dy, half, light.radius, h)
        slopes[1, 0], _ = slope_of_disc(dy, dx, half, light.radius, h)
        seen[0, 0] = covered_share(ax + h, ay + h, half, light.radius)
        seen[1, 0] = covered_share(max(ax - h, 0.0), max(ay - h, 0.0), half, light.radius)
        return
    _slope_between_edges(dx, dy, half, h, images, slopes[0])
    _slope_between_edges(dy, dx, half, h, images, slopes[1])
    near_x, near_y = max(ax - half - h, 0.0), max(ay - half - h, 0.0)
    far_x, far_y = ax + half + h, ay + half + h
    seen[:] = 0.0
    add(seen[0], 1.0, images.below[_node(math.sqrt(far_x * far_x + far_y * far_y), images)])
    add(seen[1], 1.0, images.above[_node(math.sqrt(near_x * near_x + near_y * near_y), images)])


@njit(cache=True, nogil=True)
def _bends(x: FloatArray, y: FloatArray, wanted: BoolArray, h: float, light: Light, found: FloatArray) -> None:
    """`_bends_of_pixels`, of a sharp light, too."""
    if light.images.steep.shape[0]:
        _bends_of_pixels(x, y, wanted, light.half, h, light.images, found)
        return
    for row in range(y.size):
        for column in range(x.size):
            _, one = slope_of_disc(x[column], y[row], light.half, light.radius, h)
            _, other = slope_of_disc(y[row], x[column], light.half, light.radius, h)
            found[row, column, 0] = (one + other) * h / 2


@njit(cache=True, nogil=True)
def _at_rim(own: CellWeights, channel: IndexArray, row: int, column: int, share: float, of_rim: FloatArray) -> bool:
    """Whether the weights of a pixel's light change in a cell; their slopes and jump go to ndarray[3, n_channels]."""
    along_x = _mixed(own.slope_x, channel, row, column, share, of_rim[0])
    along_y = _mixed(own.slope_y, channel, row, column, share, of_rim[1])
    return _mixed(own.jump, channel, row, column, share, of_rim[2]) or along_x or along_y


@njit(cache=True, nogil=True)
def _looked_at(own: CellWeights, channel: IndexArray, share: float, n_channels: int, wanted: BoolArray) -> None:
    """Mark the pixels of whose light something is in any value."""
    weight = np.empty(n_channels)
    for row in range(channel.shape[0]):
        for column in range(channel.shape[1]):
            wanted[row, column] = _mixed(own.high, channel, row, column, share, weight)


@njit(cache=True, nogil=True)
def _add_rim(
    of_rim: FloatArray, slopes: FloatArray, light: FloatArray, corners: FloatArray, h: float, found: FloatArray
) -> None:
    """Add what changes because a pixel's weight in a channel does, ndarray[n_parts].

    `of_rim`: ndarray[3]; see `_at_rim`. `slopes`: ndarray[2, n_parts]. `light`, `corners`: the lowest and the highest
    light of the pixel, and ratio of the channel for a weight that goes through one filter alone, ndarray[2, n_parts].
    """
    for part in range(found.size):
        apart = max(light[1, part] - corners[0, part], corners[1, part] - light[0, part])
        sloping = of_rim[0] * slopes[0, part] + of_rim[1] * slopes[1, part]
        found[part] += of_rim[2] * apart * (h / 2) + sloping * h**2


@njit(cache=True, nogil=True)
def _of_cell(
    x: FloatArray,
    y: FloatArray,
    channel: IndexArray,
    own: CellWeights,
    light: Light,
    h: float,
    corners: FloatArray,
    wanted: BoolArray,
    bends: FloatArray,
    found: FloatArray,
) -> None:
    """`deviations` of one cell. `corners`: ndarray[2, n_channels, n_channels, n_parts]."""
    n_channels, n_parts = found.shape[0], found.shape[2]
    slopes, seen, ratio = np.empty((3, 2, n_parts))
    weight, of_rim = np.empty(n_channels), np.empty((3, n_channels))
    _looked_at(own, channel, light.share, n_channels, wanted)
    _bends(x, y, wanted, h, light, bends)
    found[:] = 0.0
    for row in range(y.size):
        for column in range(x.size):
            if not wanted[row, column]:
                continue
            to = channel[row, column]
            _mixed(own.high, channel, row, column, light.share, weight)
            for u in range(n_channels):
                if weight[u] > 0:
                    add(found[u, to], weight[u], bends[row, column])
            # Elsewhere than at the rim of the readout the weights are the same in the whole cell.
            if _at_rim(own, channel, row, column, light.share, of_rim):
                _light_in_cell(x[column], y[row], h, light, slopes, seen)
                for u in range(n_channels):
                    if weight[u] <= 0:  # no part of the cell gives it one
                        continue
                    own_share = 1 / light.taken[u, to] if light.taken[u, to] > 0 else 0.0
                    ratio[:] = 0.0
                    for end in range(2):
                        add(ratio[end], own_share, corners[end, u, to])
                    _add_rim(of_rim[:, u], slopes, seen, ratio, h, found[u, to])


@njit(cache=True, nogil=True)
def deviations(
    x: FloatArray,
    y: FloatArray,
    channel: IndexArray,
    weights: CellWeights,
    light: Light,
    h: float,
    corners: FloatArray,
    found: FloatArray,
) -> None:
    """How far the weighted light less that share of the weights which it is at the corners may be, in cells of half
    width `h`, from the interpolation of its values there.

    `corners`: range of each part of the kernel there, ndarray[n_cells, 2, n_channels, n_channels, n_parts]. `found`:
    ndarray[n_cells, n_channels, n_channels, n_parts].
    """
    bends, wanted = np.empty((*channel.shape, found.shape[3])), np.empty(channel.shape, dtype=np.bool_)
    for cell in range(len(x)):
        slopes = weights.slope_x[cell], weights.slope_y[cell]
        own = CellWeights(weights.high[cell], *slopes, weights.jump[cell])
        _of_cell(x[cell], y[cell], channel, own, light, h, corners[cell], wanted, bends, found[cell])


@njit(cache=True, nogil=True)
def ranges(values: FloatArray, middle: int, ends: IndexArray) -> FloatArray:
    """Smallest and largest of values, ndarray[n, n_knots], at the middle knot, and of what differs from it in each band
    from one of `ends` to the next: ndarray[2, n, n_parts].
    """
    found = np.empty((2, len(values), ends.size))
    for at in range(len(values)):
        own = values[at]
        found[:, at, 0] = own[middle]
        for band in range(1, ends.size):
            least, most = np.inf, -np.inf
            for knot in range(ends[band - 1], ends[band] + 1):
                least, most = min(least, own[knot]), max(most, own[knot])
            found[0, at, band], found[1, at, band] = least - own[middle], most - own[middle]
    return found
