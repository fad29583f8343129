"""Compiled inner loops of the slopes of a pixel's light over cells of places. They release the GIL.

What they work on are plain arrays: taking one out of a tuple would take longer than what is done with it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..base.machine_code import njit
from ..base.types import FloatArray, IndexArray
from .compiled_areas import bends_of_disc, slope_of_disc
from .compiled_light import covered_share

SEGMENTS = 4
"""Parts of a pixel's edge over which the image's slope is bounded one by one."""
SQUARES = 3
"""Parts of a pixel along either axis over which the image is bounded one by one."""
BOUNDED = 16
"""Parts of an image: loops over them have so many rounds, which is known when they are compiled."""
ABOVE, BELOW, STEEP, BENT, INNER = range(5)
"""The envelopes of an image."""
N_SEEN = 12
LOW, HIGH, SLOPES, BENDS, THIRDS, SUDDEN, JUMPS = 0, 1, 2, 4, 6, 8, 10
"""What is known of a pixel's light over a cell: the lowest and the highest; along either axis the largest slope, second
and third derivative, and, of a sharp image alone, how much the slope changes at most, and by how much the second
derivative jumps in all. Those of a sharp image may be infinite."""
_FINITE = {"contract", "nnan", "nsz"}


class Envelopes(NamedTuple):
    """Of parts of a blurred image, as functions of the radius, `table`: ndarray[5, n_radii, BOUNDED].

    No value from a radius on is larger than `ABOVE`, none up to it smaller than `BELOW`; near it no slope is steeper
    than `STEEP`, no second derivative along any line larger than `BENT`, and those along two lines across are `INNER`
    together at most, over a whole pixel. `per_px`: radii per pixel. A sharp image has none.
    """

    table: FloatArray
    per_px: float


SHARP = Envelopes(np.empty((5, 0, BOUNDED)), 0.0)


@njit(cache=True, nogil=True, fastmath=_FINITE)
def extremes_of_parts(values: FloatArray, slopes: FloatArray, middle: int, ends: IndexArray, found: FloatArray) -> None:
    """Put what parts of a round image are at radii one after the other from 0 on into `found`, ndarray[4, n_radii,
    n_parts]: the largest and the smallest value, the largest size of a slope, and of the difference of those before and
    behind.

    `values`, `slopes`: ndarray[n_radii, n_wavelengths]. The first part is that at the `middle` wavelength, the others
    are what differs from it at the wavelengths from one of `ends` to the next.
    """
    last = len(values) - 1
    for at in range(len(values)):
        # Slopes are odd; at the last radius the difference is that before it.
        before, behind = (slopes[max(at, 2) - 2], slopes[last]) if at == last else (slopes[abs(at - 1)], slopes[at + 1])
        turned = -1.0 if at == 0 else 1.0
        for part in range(ends.size):
            first, end = (middle, middle) if part == 0 else (ends[part - 1], ends[part])
            own = 0.0 if part == 0 else 1.0
            value, slope = own * values[at, middle], own * slopes[at, middle]
            bend = own * (behind[middle] - turned * before[middle])
            above, below, steep, bent = -math.inf, math.inf, 0.0, 0.0
            for wave in range(first, end + 1):
                above, below = max(above, values[at, wave] - value), min(below, values[at, wave] - value)
                steep = max(steep, abs(slopes[at, wave] - slope))
                bent = max(bent, abs(behind[wave] - turned * before[wave] - bend))
            found[0, at, part], found[1, at, part], found[2, at, part], found[3, at, part] = above, below, steep, bent


@njit(cache=True, nogil=True)
def room_for_radii() -> tuple[FloatArray, IndexArray]:
    """Where `light_in_cell` works: radii and shares, and the nodes nearest to radii."""
    most = 12 * SEGMENTS + 2 * SQUARES**2
    return np.empty((2, most)), np.empty(most, dtype=np.int64)


@njit(cache=True, nogil=True, fastmath=_FINITE)
def _radii_of_pixel(dx: float, dy: float, half: float, h: float, segments: int, squares: int, room: FloatArray) -> None:
    """Put the radii of a pixel's pieces and squares, wherever the light is in a cell, into `room`.

    The nearest, the middle and the furthest one of each piece of the edges to the left and right, and of those below
    and above; and the furthest and nearest of each square. Behind them, how much of a slope along the radius is across
    each piece at most.
    """
    squared, n, piece = room[0], 4 * segments, 2 * half / segments
    for edge in range(4):
        along, across = (dx, dy) if edge < 2 else (dy, dx)
        away = abs(along - half) if edge % 2 == 0 else abs(along + half)
        near, far = max(away - h, 0.0), away + h
        for segment in range(segments):
            middle = abs(across + (segment + 0.5) * piece - half)
            low, high, at = max(middle - piece / 2 - h, 0.0), middle + piece / 2 + h, edge * segments + segment
            squared[at] = near * near + low * low
            squared[n + at] = away * away + middle * middle
            squared[2 * n + at] = far * far + high * high
            room[1, at] = far
    side = 2 * half / squares
    reach = side / 2 + h
    for row in range(squares):
        y = abs(dy - half + (row + 0.5) * side)
        near_y, far_y = max(y - reach, 0.0), y + reach
        for column in range(squares):
            x = abs(dx - half + (column + 0.5) * side)
            near_x, far_x, at = max(x - reach, 0.0), x + reach, 3 * n + 2 * (row * squares + column)
            squared[at], squared[at + 1] = far_x * far_x + far_y * far_y, near_x * near_x + near_y * near_y
    for at in range(3 * n + 2 * squares**2):
        squared[at] = math.sqrt(squared[at])
    for at in range(n):
        room[1, at] = min(1.0, room[1, at] / max(squared[at], 1e-9))


@njit(cache=True, nogil=True, fastmath=_FINITE)
def add_row(factor: float, table: FloatArray, which: int, node: int, found: FloatArray, to: int) -> None:
    """Add an envelope at a radius, times a factor, to a row."""
    for part in range(BOUNDED):
        found[to, part] += factor * table[which, node, part]


@njit(cache=True, nogil=True, fastmath=_FINITE)
def _add_piece(
    nodes: IndexArray, piece: int, segments: int, across: FloatArray, table: FloatArray, seen: FloatArray, axis: int
) -> None:
    """Add what a piece of one edge and that of the other one across an axis have of the slope, and of the second and
    the third derivative, to their rows: the largest difference of the light, the sums of its slopes and of its bends.

    `nodes`: of the nearest, the middle and the furthest radius of each piece; `across`: see `_radii_of_pixel`.
    """
    n, other = 4 * segments, piece + segments
    near, middle, far = nodes[piece], nodes[n + piece], nodes[2 * n + piece]
    near_beyond, beyond, far_beyond = nodes[other], nodes[n + other], nodes[2 * n + other]
    one, two = across[piece], across[other]
    for part in range(BOUNDED):
        seen[SLOPES + axis, part] += max(
            table[ABOVE, near, part] - table[BELOW, far_beyond, part],
            table[ABOVE, near_beyond, part] - table[BELOW, far, part],
        )
        seen[BENDS + axis, part] += one * table[STEEP, middle, part] + two * table[STEEP, beyond, part]
        seen[THIRDS + axis, part] += table[BENT, middle, part] + table[BENT, beyond, part]


@njit(cache=True, nogil=True, fastmath=_FINITE)
def _scale(factor: float, found: FloatArray, to: int) -> None:
    """Multiply a row."""
    for part in range(BOUNDED):
        found[to, part] *= factor


@njit(cache=True, nogil=True, fastmath=_FINITE)
def of_blurred(
    dx: float,
    dy: float,
    half: float,
    h: float,
    table: FloatArray,
    per_px: float,
    closely: bool,
    room: FloatArray,
    nodes: IndexArray,
    seen: FloatArray,
) -> None:
    """Put what is known of a blurred light on a pixel over a cell into `seen`, ndarray[N_SEEN, BOUNDED].

    `closely`: by parts of its edges and of its area, one by one.
    """
    segments, squares = (SEGMENTS, SQUARES) if closely else (1, 1)
    n, last = 4 * segments, table.shape[1] - 1.0
    _radii_of_pixel(dx, dy, half, h, segments, squares, room)
    for at in range(3 * n + 2 * squares**2):
        nodes[at] = int(min(room[0, at] * per_px + 0.5, last))
    for to in range(SUDDEN):
        for part in range(BOUNDED):
            seen[to, part] = 0.0
    for at in range(3 * n, 3 * n + 2 * squares**2, 2):  # the mean over a pixel is that of those over its squares
        add_row(1 / squares**2, table, BELOW, nodes[at], seen, LOW)
        add_row(1 / squares**2, table, ABOVE, nodes[at + 1], seen, HIGH)
    scale = 1 / (segments * 2 * half)
    for axis in range(2):
        for segment in range(segments):
            _add_piece(nodes, 2 * axis * segments + segment, segments, room[1], table, seen, axis)
        _scale(scale, seen, SLOPES + axis)
        _scale(scale, seen, BENDS + axis)
        _scale(scale, seen, THIRDS + axis)


@njit(cache=True, nogil=True)
def of_sharp(dx: float, dy: float, half: float, radius: float, h: float, seen: FloatArray) -> None:
    """Put what is known of a sharp light on a pixel over a cell into the first lane of `seen`."""
    seen[LOW, 0] = covered_share(abs(dx) + h, abs(dy) + h, half, radius)
    seen[HIGH, 0] = covered_share(max(abs(dx) - h, 0.0), max(abs(dy) - h, 0.0), half, radius)
    for axis in range(2):
        along, across = (dx, dy) if axis == 0 else (dy, dx)
        seen[SLOPES + axis, 0], seen[SUDDEN + axis, 0] = slope_of_disc(along, across, half, radius, h)
        bend, jump, third = bends_of_disc(along, across, half, radius, h)
        seen[BENDS + axis, 0], seen[JUMPS + axis, 0], seen[THIRDS + axis, 0] = bend, jump, third
