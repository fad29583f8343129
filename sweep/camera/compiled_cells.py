"""Compiled inner loops of the bounds on what lies between places. They release the GIL."""

from __future__ import annotations

import math

import numpy as np

from ..base.machine_code import njit
from ..base.types import FloatArray, IndexArray
from .compiled_areas import BOTH_AXES, JUMP, SLOPE, THIRD, CellWeights
from .compiled_light import add, to_channels
from .compiled_slopes import Light, LightInCell, light_in_cell, node


@njit(cache=True, nogil=True)
def _is_at_rim(own: CellWeights, row: int, column: int, share: float) -> bool:
    """Whether the weights of a pixel's light change in a cell: its own, or those of its neighbors."""
    if own.sudden[row, column, 0] > 0 or own.sudden[row, column, 1] > 0:
        return True
    if share > 0:
        rows, columns = own.high.shape
        for to_row, to_column in ((row - 1, column), (row + 1, column), (row, column - 1), (row, column + 1)):
            inside = 0 <= to_row < rows and 0 <= to_column < columns
            if inside and (own.sudden[to_row, to_column, 0] > 0 or own.sudden[to_row, to_column, 1] > 0):
                return True
    return False


@njit(cache=True, nogil=True)
def _mix_rim(own: CellWeights, channel: IndexArray, row: int, column: int, share: float, of_rim: FloatArray) -> None:
    """Put what is known of how the weights of a pixel's light change in a cell into ndarray[5, 2, n_channels]: slope,
    how much it changes, second derivative, its jumps and third derivative, along either axis.
    """
    for axis in range(2):
        to_channels(own.slope[:, :, axis], channel, row, column, share, of_rim[0, axis])
        to_channels(own.sudden[:, :, axis], channel, row, column, share, of_rim[1, axis])
        to_channels(own.bend[:, :, axis], channel, row, column, share, of_rim[2, axis])
        to_channels(own.jump[:, :, axis], channel, row, column, share, of_rim[3, axis])
        to_channels(own.third[:, :, axis], channel, row, column, share, of_rim[4, axis])


@njit(cache=True, nogil=True)
def _add_inner(
    weight: float, dx: float, dy: float, h: float, light: Light, seen: LightInCell, found: FloatArray
) -> None:
    """Add what the light of a pixel whose weight is the same in the whole cell may be off, ndarray[n_parts]."""
    images = light.images
    if images.steep.shape[0]:
        smooth = BOTH_AXES * THIRD * h**3 / light.half
        add(found, weight * smooth, images.inner[node(math.hypot(dx, dy), images)])
        return
    light_in_cell(dx, dy, h, light, seen)
    for axis in range(2):
        off = SLOPE * h * seen.sudden[axis, 0]
        if seen.thirds[axis, 0] < math.inf:
            off = min(off, THIRD * h**3 * seen.thirds[axis, 0] + JUMP * h**2 * seen.jumps[axis, 0])
        found[0] += BOTH_AXES * weight * off


@njit(cache=True, nogil=True)
def _add_rim(
    weight: float, of_rim: FloatArray, seen: LightInCell, ratio: FloatArray, h: float, found: FloatArray
) -> None:
    """Add what the light of a pixel, less `ratio`, times its changing weight in a channel may be off, ndarray[n_parts].

    `of_rim`: ndarray[5, 2] (`_mix_rim`); `ratio`: the lowest and the highest of the channel for a weight that goes
    through one filter alone, ndarray[2, n_parts]. A product's derivatives are Leibniz's sums; where a third one has no
    bound, how much its slope changes has.
    """
    for part in range(found.size):
        apart = max(seen.values[1, part] - ratio[0, part], ratio[1, part] - seen.values[0, part])
        for axis in range(2):
            slope, sudden, bend = of_rim[0, axis], of_rim[1, axis], of_rim[2, axis]
            jump, third = of_rim[3, axis], of_rim[4, axis]
            one, two, three = seen.slopes[axis, part], seen.bends[axis, part], seen.thirds[axis, part]
            off = SLOPE * h * (sudden * apart + 4 * h * slope * one + weight * seen.sudden[axis, part])
            if third < math.inf and three < math.inf:
                even = third * apart + 3 * bend * one + 3 * slope * two + weight * three
                jumps = jump * apart + weight * seen.jumps[axis, part]
                off = min(off, THIRD * h**3 * even + JUMP * h**2 * jumps)
            found[part] += BOTH_AXES * off


@njit(cache=True, nogil=True)
def _of_cell(
    x: FloatArray,
    y: FloatArray,
    channel: IndexArray,
    own: CellWeights,
    light: Light,
    h: float,
    nodes: FloatArray,
    seen: LightInCell,
    found: FloatArray,
) -> None:
    """`deviations` of one cell. `nodes`: ndarray[2, n_channels, n_channels, n_parts]."""
    n_channels, n_parts = found.shape[0], found.shape[2]
    ratio = np.empty((2, n_parts))
    weight, of_rim = np.empty(n_channels), np.empty((5, 2, n_channels))
    found[:] = 0.0
    for row in range(y.size):
        for column in range(x.size):
            if not to_channels(own.high, channel, row, column, light.share, weight):
                continue
            to = channel[row, column]
            # Elsewhere than at the rim of the readout the weights are the same in the whole cell.
            if not _is_at_rim(own, row, column, light.share):
                for u in range(n_channels):
                    if weight[u] > 0:
                        _add_inner(weight[u], x[column], y[row], h, light, seen, found[u, to])
                continue
            _mix_rim(own, channel, row, column, light.share, of_rim)
            light_in_cell(x[column], y[row], h, light, seen)
            for u in range(n_channels):
                if weight[u] <= 0:  # no part of the cell gives it one
                    continue
                own_share = 1 / light.taken[u, to] if light.taken[u, to] > 0 else 0.0
                ratio[:] = 0.0
                for end in range(2):
                    add(ratio[end], own_share, nodes[end, u, to])
                _add_rim(weight[u], of_rim[:, :, u], seen, ratio, h, found[u, to])


@njit(cache=True, nogil=True)
def deviations(
    x: FloatArray,
    y: FloatArray,
    channel: IndexArray,
    weights: CellWeights,
    light: Light,
    h: float,
    nodes: FloatArray,
    found: FloatArray,
) -> None:
    """How far the weighted light less that share of the weights which it is at the nodes may be, in cells of half width
    `h`, from the interpolation through its values there: see `compiled_areas`.

    `nodes`: range of each part of the kernel there, ndarray[n_cells, 2, n_channels, n_channels, n_parts]. `found`:
    ndarray[n_cells, n_channels, n_channels, n_parts].
    """
    values, slopes, sudden, bends, jumps, thirds = np.empty((6, 2, found.shape[3]))
    seen = LightInCell(values, slopes, sudden, bends, jumps, thirds)
    for cell in range(len(x)):
        own = CellWeights(
            weights.high[cell],
            weights.slope[cell],
            weights.sudden[cell],
            weights.bend[cell],
            weights.jump[cell],
            weights.third[cell],
        )
        _of_cell(x[cell], y[cell], channel, own, light, h, nodes[cell], seen, found[cell])


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
