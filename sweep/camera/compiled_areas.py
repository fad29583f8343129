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

import numpy as np

from ..base.machine_code import njit
from ..base.types import FloatArray, IndexArray
from .compiled_light import covered_share

THIRD = 1 / (9 * math.sqrt(3))
JUMP = 1 / 16
SLOPE = 3 / 8
BOTH_AXES = 9 / 8


class CellWeights(NamedTuple):
    """Weights of pixels in the readout over cells of places, ndarray[n_cells, n_rows, n_columns].

    `high`: the largest. `slope`, `sudden`, `bend`, `jump`, `third`: for either axis (column, row) the largest slope,
    how much it changes, the largest second derivative, by how much that jumps in all, and the largest third one, [...,
    2] each; the last three are infinite where they have no bound.
    """

    high: FloatArray
    slope: FloatArray
    sudden: FloatArray
    bend: FloatArray
    jump: FloatArray
    third: FloatArray

    @staticmethod
    def constant(high: FloatArray) -> CellWeights:
        """Weights that are the same in the whole cell."""
        nothing = np.zeros((*high.shape, 2))
        return CellWeights(high, nothing, nothing, nothing, nothing, nothing)


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
    x, y = abs(x), abs(y)
    if math.hypot(x + h, y + h) <= radius:
        return 1
    return -1 if math.hypot(max(x - h, 0.0), max(y - h, 0.0)) >= radius else 0


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
def _share_in_cell(
    dx: float, dy: float, half: float, radius: float, h: float, own: CellWeights, at: tuple[int, int, int]
) -> None:
    """Put what is known of the share of a pixel at the disc's rim into the weights."""
    cell, row, column = at
    own.high[cell, row, column] = covered_share(max(abs(dx) - h, 0.0), max(abs(dy) - h, 0.0), half, radius)
    for axis in range(2):
        along, across = (dx, dy) if axis == 0 else (dy, dx)
        own.slope[cell, row, column, axis], own.sudden[cell, row, column, axis] = slope_of_disc(
            along, across, half, radius, h
        )
        bend, jump, third = bends_of_disc(along, across, half, radius, h)
        own.bend[cell, row, column, axis], own.jump[cell, row, column, axis] = bend, jump
        own.third[cell, row, column, axis] = third


@njit(cache=True, nogil=True)
def _add_moves(own: CellWeights, at: tuple[int, int, int], h: float, moves: FloatArray) -> None:
    """Add how far a share times a parabola may be from its interpolation, for the size of the parabola, of its slope
    and of its second derivative: ndarray[3].
    """
    cell, row, column = at
    for axis in range(2):
        slope, sudden = own.slope[cell, row, column, axis], own.sudden[cell, row, column, axis]
        bend, jump = own.bend[cell, row, column, axis], own.jump[cell, row, column, axis]
        third = own.third[cell, row, column, axis]
        if THIRD * h**3 * third + JUMP * h**2 * jump <= SLOPE * h * sudden:
            smooth = BOTH_AXES * THIRD * h**3
            moves[0] += smooth * third + BOTH_AXES * JUMP * h**2 * jump
            moves[1] += 3 * smooth * bend
            moves[2] += 3 * smooth * slope
        else:
            moves[0] += BOTH_AXES * SLOPE * h * sudden
            moves[1] += BOTH_AXES * SLOPE * 4 * h**2 * slope
            moves[2] += BOTH_AXES * SLOPE * 2 * h**2 * own.high[cell, row, column]


@njit(cache=True, nogil=True)
def areas(
    x: FloatArray,
    y: FloatArray,
    channel: IndexArray,
    half: float,
    radius: float,
    h: float,
    weights: CellWeights,
    sums: FloatArray,
    moves: FloatArray,
) -> None:
    """Of a mean over a disc of `radius`: the weights of the pixels.

    And the sum of each channel's weights at the nodes, ndarray[n_cells, 9, n_channels], and how far this sum times a
    parabola may be in a cell from the interpolation through the nodes, ndarray[n_cells, n_channels, 3] (`_add_moves`).
    All are nothing before. `x`: ndarray[n_cells, n_columns], `y`: ndarray[n_cells, n_rows], pixels from the centers of
    the cells; `channel`: ndarray[n_rows, n_columns].
    """
    for cell in range(len(x)):
        for row in range(y.shape[1]):
            for column in range(x.shape[1]):
                dx, dy, own = x[cell, column], y[cell, row], channel[row, column]
                nearest = math.hypot(max(abs(dx) - h - half, 0.0), max(abs(dy) - h - half, 0.0))
                if nearest >= radius:
                    continue
                if math.hypot(abs(dx) + h + half, abs(dy) + h + half) <= radius:
                    weights.high[cell, row, column] = 1.0
                    for node in range(9):
                        sums[cell, node, own] += 1.0
                    continue
                _share_in_cell(dx, dy, half, radius, h, weights, (cell, row, column))
                _add_moves(weights, (cell, row, column), h, moves[cell, own])
                for node in range(9):
                    to_x, to_y = h * (node % 3 - 1), h * (node // 3 - 1)
                    sums[cell, node, own] += covered_share(dx - to_x, dy - to_y, half, radius)
