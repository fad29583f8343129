"""Compiled inner loops of the slopes of a pixel's light over cells of places. They release the GIL."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..base.machine_code import njit
from ..base.types import FloatArray
from .compiled_areas import bends_of_disc, slope_of_disc
from .compiled_light import add, covered_share

SEGMENTS = 4
"""Parts of a pixel's edge over which the image's slope is bounded one by one."""
SQUARES = 3
"""Parts of a pixel along either axis over which the image is bounded one by one."""


class Envelopes(NamedTuple):
    """Of parts of a blurred image, as functions of the radius, ndarray[n_radii, n_parts] each.

    No value from a radius on is above `above`, none up to it below `below`; near it no slope is steeper than `steep`,
    no second derivative along any line larger than `bent`, and those along two lines across are `inner` together at
    most, over a whole pixel. `per_px`: radii per pixel. A sharp image has none.
    """

    above: FloatArray
    below: FloatArray
    steep: FloatArray
    bent: FloatArray
    inner: FloatArray
    per_px: float


_NONE = np.empty((0, 1))
SHARP = Envelopes(_NONE, _NONE, _NONE, _NONE, _NONE, 0.0)


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


class LightInCell(NamedTuple):
    """Of a pixel's light over a cell, ndarray[2, n_parts] each: the lowest and the highest; along either axis the
    largest slope, how much it changes at most, the largest second derivative, by how much that jumps in all, and the
    largest third one. Those of a sharp image may be infinite.
    """

    values: FloatArray
    slopes: FloatArray
    sudden: FloatArray
    bends: FloatArray
    jumps: FloatArray
    thirds: FloatArray


@njit(cache=True, nogil=True)
def node(r: float, images: Envelopes) -> int:
    """The node nearest to a radius."""
    return int(min(r * images.per_px + 0.5, images.steep.shape[0] - 1.0))


@njit(cache=True, nogil=True)
def _bends_of_edge(
    away: float, middle: float, half: float, h: float, images: Envelopes, bends: FloatArray, thirds: FloatArray
) -> None:
    """Add what an edge, `away` from the light's center and `half` to both sides of `middle` long, has of the second and
    of the third derivative of a pixel's light across it.
    """
    piece = 2 * half / SEGMENTS
    edge = abs(away)
    near = max(edge - h, 0.0)
    scale = 1 / (SEGMENTS * 2 * half)
    for segment in range(SEGMENTS):
        across = abs(middle + (segment + 0.5) * piece - half)
        low = max(across - piece / 2 - h, 0.0)
        low_r = math.sqrt(near * near + low * low)
        towards = scale * min(1.0, (edge + h) / max(low_r, 1e-9))
        at = node(math.sqrt(edge * edge + across * across), images)
        steep, bent = images.steep[at], images.bent[at]
        for part in range(bends.size):
            bends[part] += steep[part] * towards
            thirds[part] += bent[part] * scale


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
            node(math.sqrt(max(left - h, 0.0) ** 2 + low * low), images),
            node(math.sqrt((left + h) ** 2 + high * high), images),
            node(math.sqrt(max(right - h, 0.0) ** 2 + low * low), images),
            node(math.sqrt((right + h) ** 2 + high * high), images),
        )
        above_left, below_left = images.above[nodes[0]], images.below[nodes[1]]
        above_right, below_right = images.above[nodes[2]], images.below[nodes[3]]
        for part in range(found.size):
            found[part] += max(above_left[part] - below_right[part], above_right[part] - below_left[part])
    for part in range(found.size):
        found[part] /= SEGMENTS * 2 * half


@njit(cache=True, nogil=True)
def _between_values(dx: float, dy: float, half: float, h: float, images: Envelopes, values: FloatArray) -> None:
    """Put the lowest and the highest mean over a pixel in a cell into `values`, ndarray[2, n_parts]: the means of those
    of its squares.
    """
    side = 2 * half / SQUARES
    reach = side / 2 + h
    values[:] = 0.0
    for row in range(SQUARES):
        y = abs(dy - half + (row + 0.5) * side)
        for column in range(SQUARES):
            x = abs(dx - half + (column + 0.5) * side)
            near_x, near_y, far_x, far_y = max(x - reach, 0.0), max(y - reach, 0.0), x + reach, y + reach
            add(values[0], 1 / SQUARES**2, images.below[node(math.sqrt(far_x * far_x + far_y * far_y), images)])
            add(values[1], 1 / SQUARES**2, images.above[node(math.sqrt(near_x * near_x + near_y * near_y), images)])


@njit(cache=True, nogil=True)
def _of_sharp(dx: float, dy: float, h: float, light: Light, seen: LightInCell) -> None:
    """`light_in_cell` of a sharp image."""
    half, radius = light.half, light.radius
    seen.values[0, 0] = covered_share(abs(dx) + h, abs(dy) + h, half, radius)
    seen.values[1, 0] = covered_share(max(abs(dx) - h, 0.0), max(abs(dy) - h, 0.0), half, radius)
    for axis in range(2):
        along, across = (dx, dy) if axis == 0 else (dy, dx)
        seen.slopes[axis, 0], seen.sudden[axis, 0] = slope_of_disc(along, across, half, radius, h)
        bend, jump, third = bends_of_disc(along, across, half, radius, h)
        seen.bends[axis, 0], seen.jumps[axis, 0], seen.thirds[axis, 0] = bend, jump, third


@njit(cache=True, nogil=True)
def light_in_cell(dx: float, dy: float, h: float, light: Light, seen: LightInCell) -> None:
    """Put what is known of a pixel's light over a cell into `seen`."""
    half, images = light.half, light.images
    if not images.steep.shape[0]:
        _of_sharp(dx, dy, h, light, seen)
        return
    _between_values(dx, dy, half, h, images, seen.values)
    seen.bends[:] = 0.0
    seen.jumps[:] = 0.0
    seen.thirds[:] = 0.0
    for axis in range(2):
        along, across = (dx, dy) if axis == 0 else (dy, dx)
        _slope_between_edges(along, across, half, h, images, seen.slopes[axis])
        for side in (-half, half):
            _bends_of_edge(along + side, across, half, h, images, seen.bends[axis], seen.thirds[axis])
        for part in range(seen.bends.shape[1]):
            seen.sudden[axis, part] = 2 * h * seen.bends[axis, part]
