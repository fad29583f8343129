"""Compiled inner loops of the share of pixels that a sharp disc covers in cells of places. They release the GIL.

What is bounded is how far a function may be, in a cell of half width h, from the biquadratic one through its values at
the cell's nine nodes (`phase.NODES`). Along one axis that is at most h^3 / (9 sqrt 3) times its third derivative
(Cauchy's remainder), and h^2 / 16 of each jump of its second one (reached by a jump at the middle node), and at most
3/8 h times what its slope changes by: half of that change lies to either side of a straight line, so that between two
nodes it is h / 4 of the change from the line through them, and the parabola h / 8.
Along both axes: the sum, times the mean of 1 and of 5/4, the largest that a parabola through three values can be.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ..base.machine_code import njit
from ..base.types import FloatArray, IndexArray
from .compiled_light import covered_share

THIRD = 1 / (9 * math.sqrt(3))
JUMP = 1 / 16
SLOPE = 3 / 8
BOTH_AXES = 9 / 8


DARK, WHOLE, RIM = 0, 1, 2
"""Kinds of pixels in a cell: with no weight, with the same at all its places, and with one that changes."""
_SLOPE, _SUDDEN, _BEND, _JUMP, THIRD_AT = 0, 2, 4, 6, 8
N_CHANGES = 10


class CellWeights(NamedTuple):
    """Weights of pixels in the readout over a cell of places, ndarray[n_rows, n_columns].

    `kind`: of each pixel. `high`: the largest weight. `change`: of those at the rim, ndarray[..., N_CHANGES], for
    either axis (column, row) the largest slope, how much it changes, the largest second derivative, by how much that
    jumps in all, and the largest third one; the last three are infinite where they have no bound.
    """

    kind: IndexArray
    high: FloatArray
    change: FloatArray


@njit(cache=True, nogil=True)
def _overlap(y: float, half: float, reach: float) -> float:
    """Length of y - half..y + half that lies in -reach..reach."""
    return max(0.0, min(y + half, reach) - max(y - half, -reach))


@njit(cache=True, nogil=True)
def slope_of_disc(along: float, across: float, half: float, radius: float, h: float) -> tuple[float, float]:
    """Of the share of a pixel that a sharp disc covers, along one axis in a cell of half width `h`: the largest slope,
    and how much it changes at most.
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
def _always(x: float, y: float, radius: float, h: float) -> int:
    """Whether a point is inside the disc (1) or outside (-1) at all places of a cell, or neither (0)."""
    x, y, squared = abs(x), abs(y), radius * radius
    if (x + h) * (x + h) + (y + h) * (y + h) <= squared:
        return 1
    x, y = max(x - h, 0.0), max(y - h, 0.0)
    return -1 if x * x + y * y >= squared else 0


@njit(cache=True, nogil=True)
def bends_of_disc(along: float, across: float, half: float, radius: float, h: float) -> tuple[float, float, float]:
    """Of the second derivative along one axis of the share of a pixel that a sharp disc covers: the largest size, by
    how much it jumps in all, and the largest slope between the jumps.

    It is that of the chords that the circle cuts off the pixel's two edges across the axis, sqrt(radius^2 - t^2) at t
    from the center; it jumps where the circle leaves an edge at its end.
    """
    bend = jump = third = 0.0
    for side in (-half, half):
        edge = along + side
        ends = _always(edge, across - half, radius, h), _always(edge, across + half, radius, h)
        if ends[0] == 1 and ends[1] == 1:
            continue
        nearest, furthest, low = max(abs(edge) - h, 0.0), abs(edge) + h, max(abs(across) - half - h, 0.0)
        if ends[0] == -1 and ends[1] == -1 and (nearest >= radius or abs(across) - h >= half):
            continue
        # Where the circle crosses the edge, it is at least so far from the axis.
        squared = max((radius - furthest) * (radius + furthest), low**2)
        if squared <= 0:
            return math.inf, math.inf, math.inf
        steep = furthest / math.sqrt(squared)
        times = 1.0 if low > 0 or ends[0] == 1 or ends[1] == 1 else 2.0
        bend += times * steep
        third += times * radius**2 / squared**1.5
        for end in ends:
            if end == 0:
                jump += steep if abs(edge) >= h else 2 * steep
    area = 4 * half**2
    return bend / area, jump / area, third / area


@njit(cache=True, nogil=True)
def _share_in_cell(dx: float, dy: float, half: float, radius: float, h: float, change: FloatArray) -> float:
    """Put what is known of the share of a pixel at the disc's rim into `change`, ndarray[N_CHANGES]; the largest."""
    for axis in range(2):
        along, across = (dx, dy) if axis == 0 else (dy, dx)
        change[_SLOPE + axis], change[_SUDDEN + axis] = slope_of_disc(along, across, half, radius, h)
        bend, jump, third = bends_of_disc(along, across, half, radius, h)
        change[_BEND + axis], change[_JUMP + axis], change[THIRD_AT + axis] = bend, jump, third
    return float(covered_share(max(abs(dx) - h, 0.0), max(abs(dy) - h, 0.0), half, radius))


@njit(cache=True, nogil=True)
def _add_moves(high: float, change: FloatArray, h: float, moves: FloatArray) -> None:
    """Add how far a share times a parabola may be from its interpolation, for the size of the parabola, of its slope
    and of its second derivative: ndarray[3].
    """
    for axis in range(2):
        slope, sudden, bend = change[_SLOPE + axis], change[_SUDDEN + axis], change[_BEND + axis]
        jump, third = change[_JUMP + axis], change[THIRD_AT + axis]
        if THIRD * h**3 * third + JUMP * h**2 * jump <= SLOPE * h * sudden:
            smooth = BOTH_AXES * THIRD * h**3
            moves[0] += smooth * third + BOTH_AXES * JUMP * h**2 * jump
            moves[1] += 3 * smooth * bend
            moves[2] += 3 * smooth * slope
        else:
            moves[0] += BOTH_AXES * SLOPE * h * sudden
            moves[1] += BOTH_AXES * SLOPE * 4 * h**2 * slope
            moves[2] += BOTH_AXES * SLOPE * 2 * h**2 * high


@njit(cache=True, nogil=True)
def areas(
    x: FloatArray,
    y: FloatArray,
    channel: IndexArray,
    half: float,
    radius: float,
    h: float,
    weights: CellWeights,
    moves: FloatArray,
) -> None:
    """Put the weights of the pixels in a mean over a disc of `radius` into `weights`, for a cell.

    And how far the sum of each channel's weights, times a parabola, may be in the cell from the interpolation through
    the nodes into `moves`, ndarray[n_channels, 3] (`_add_moves`). `x`: ndarray[n_columns], `y`: ndarray[n_rows], pixels
    from the center of the cell; `channel`: ndarray[n_rows, n_columns].
    """
    moves[:] = 0.0
    reach = h + half
    for row in range(y.size):
        for column in range(x.size):
            dx, dy = abs(x[column]), abs(y[row])
            near_x, near_y = max(dx - reach, 0.0), max(dy - reach, 0.0)
            kind = RIM
            if near_x * near_x + near_y * near_y >= radius * radius:
                kind = DARK
            elif (dx + reach) * (dx + reach) + (dy + reach) * (dy + reach) <= radius * radius:
                kind = WHOLE
            weights.kind[row, column] = kind
            weights.high[row, column] = 1.0 if kind == WHOLE else 0.0
            if kind == RIM:
                change = weights.change[row, column]
                high = _share_in_cell(x[column], y[row], half, radius, h, change)
                weights.high[row, column] = high
                _add_moves(high, change, h, moves[channel[row, column]])
