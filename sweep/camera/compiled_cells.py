"""Compiled inner loops of the bounds on what lies between places. They release the GIL."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..base.machine_code import njit
from ..base.types import BoolArray, FloatArray, IndexArray
from .compiled_areas import BOTH_AXES, DARK, JUMP, N_CHANGES, RIM, SLOPE, THIRD, WHOLE, CellWeights, areas
from .compiled_light import add
from .compiled_slopes import (
    BENDS,
    BOUNDED,
    HIGH,
    INNER,
    JUMPS,
    LOW,
    N_SEEN,
    SLOPES,
    SUDDEN,
    THIRDS,
    add_row,
    of_blurred,
    of_sharp,
    room_for_radii,
)

_FINITE = {"contract", "nnan", "nsz"}


class Light(NamedTuple):
    """What is known of the light of a cell's pixels.

    `table`, `per_px`: `Envelopes` of a blurred light; a sharp one is a disc of `radius`. `half`: of a pixel's side;
    `share`: of its light that comes through its neighbors' filters. `taken`: what a pixel of each channel takes of the
    light through each channel's filter, ndarray[n_channels, n_channels], on average; `even`: whether all take the same.
    """

    table: FloatArray
    per_px: float
    half: float
    radius: float
    share: float
    taken: FloatArray
    even: bool


@njit(cache=True, nogil=True)
def _mix(
    kind: IndexArray,
    weights: FloatArray,
    changes: FloatArray,
    channel: IndexArray,
    row: int,
    column: int,
    share: float,
    high: FloatArray,
    does_change: BoolArray,
    change: FloatArray,
) -> tuple[bool, bool]:
    """Put what is known of the weights with which a pixel's light is in each channel's value into the last three: the
    largest, ndarray[n_channels], whether they change in the cell, and how (of those that do), ndarray[n_channels,
    N_CHANGES]. `kind`, `weights`, `changes`: `CellWeights`.

    Whether the light has any weight, and whether any changes.
    """
    some = at_rim = False
    high[:] = 0.0
    does_change[:] = False
    rows, columns = kind.shape
    for source in range(5 if share > 0 else 1):
        to_row, to_column = row + (source == 1) - (source == 2), column + (source == 3) - (source == 4)
        if not (0 <= to_row < rows and 0 <= to_column < columns) or kind[to_row, to_column] == DARK:
            continue
        some = True
        to, part = channel[to_row, to_column], 1 - share if source == 0 else share / 4
        high[to] += part * weights[to_row, to_column]
        if kind[to_row, to_column] == RIM:
            if not does_change[to]:
                change[to] = 0.0
            at_rim = does_change[to] = True
            add(change[to], part, changes[to_row, to_column])
    return some, at_rim


@njit(cache=True, nogil=True)
def _add_sharp(
    high: FloatArray,
    does_change: BoolArray,
    change: FloatArray,
    to: int,
    seen: FloatArray,
    ratios: FloatArray,
    h: float,
    found: FloatArray,
) -> None:
    """`_add_rim` of a sharp light on a pixel in all channels, whose slope may jump: where a third derivative has no
    bound, how much a slope changes has.
    """
    for u in range(high.size):
        if high[u] <= 0:  # no part of the cell gives it a weight
            continue
        if not does_change[u]:
            change[u] = 0.0
        weight, ratio, own = high[u], ratios[u, to], change[u]
        apart = max(seen[HIGH, 0] - ratio[0, 0], ratio[1, 0] - seen[LOW, 0])
        for axis in range(2):
            slope, sudden, bend = own[axis], own[2 + axis], own[4 + axis]
            jump, third = own[6 + axis], own[8 + axis]
            one, two, three = seen[SLOPES + axis, 0], seen[BENDS + axis, 0], seen[THIRDS + axis, 0]
            off = SLOPE * h * (sudden * apart + 4 * h * slope * one + weight * seen[SUDDEN + axis, 0])
            if third < math.inf and three < math.inf:
                even = third * apart + 3 * bend * one + 3 * slope * two + weight * three
                jumps = jump * apart + weight * seen[JUMPS + axis, 0]
                off = min(off, THIRD * h**3 * even + JUMP * h**2 * jumps)
            found[u, to, 0] += BOTH_AXES * off


@njit(cache=True, nogil=True, fastmath=_FINITE)
def _add_rim(
    weight: float,
    change: FloatArray,
    u: int,
    to: int,
    seen: FloatArray,
    ratios: FloatArray,
    h: float,
    apart: FloatArray,
    found: FloatArray,
) -> None:
    """Add what a blurred light on a pixel, less the ratio of its channel, times its changing weight in a channel `u`
    may be off to `found[u, to]`.

    `change`: ndarray[n_channels, N_CHANGES] (`CellWeights`); `ratios`: the lowest and the highest for a weight that
    goes through one filter alone, ndarray[n_channels, n_channels, 2, BOUNDED]; `apart`: ndarray[BOUNDED], to work in. A
    product's derivatives are Leibniz's sums; where a third one has no bound, how much its slope changes has. A blurred
    image has no jumps, and its slope changes by at most twice the half width times its second derivative.
    """
    for part in range(BOUNDED):
        apart[part] = max(seen[HIGH, part] - ratios[u, to, 0, part], ratios[u, to, 1, part] - seen[LOW, part])
    for axis in range(2):
        third, rough, even = change[u, 8 + axis], BOTH_AXES * SLOPE * h, BOTH_AXES * THIRD * h**3
        of_value, of_slope, of_bend = (
            rough * change[u, 2 + axis],
            rough * 4 * h * change[u, axis],
            rough * 2 * h * weight,
        )
        if not third < math.inf:
            for part in range(BOUNDED):
                found[u, to, part] += (
                    of_value * apart[part] + of_slope * seen[SLOPES + axis, part] + of_bend * seen[BENDS + axis, part]
                )
            continue
        smooth = even * third + BOTH_AXES * JUMP * h**2 * change[u, 6 + axis]
        by_slope, by_bend, by_third = 3 * even * change[u, 4 + axis], 3 * even * change[u, axis], even * weight
        for part in range(BOUNDED):
            a, b, c = apart[part], seen[SLOPES + axis, part], seen[BENDS + axis, part]
            off = of_value * a + of_slope * b + of_bend * c
            other = smooth * a + by_slope * b + by_bend * c + by_third * seen[THIRDS + axis, part]
            found[u, to, part] += min(off, other)


@njit(cache=True, nogil=True)
def _ratios(nodes: FloatArray, taken: FloatArray, found: FloatArray) -> None:
    """Put the range of the kernel for weights that go through one filter alone into `found`, ndarray[n_channels,
    n_channels, 2, n_parts]; `nodes`: ndarray[2, n_channels, n_channels, n_parts].
    """
    found[:] = 0.0
    for u in range(taken.shape[0]):
        for to in range(taken.shape[1]):
            if taken[u, to] > 0:
                for end in range(2):
                    add(found[u, to, end], 1 / taken[u, to], nodes[end, u, to])


@njit(cache=True, nogil=True)
def _given(weights: FloatArray, own: CellWeights) -> None:
    """Take weights that are the same in a whole cell."""
    for row in range(weights.shape[0]):
        for column in range(weights.shape[1]):
            own.high[row, column] = weights[row, column]
            own.kind[row, column] = WHOLE if weights[row, column] > 0 else DARK


@njit(cache=True, nogil=True)
def _is_deep(kind: IndexArray, row: int, column: int, share: float) -> bool:
    """Whether a pixel and, where they share their light, its neighbors have the same weight at all places of a cell."""
    if kind[row, column] != WHOLE:
        return False
    if share == 0:
        return True
    above, below = kind[row - 1, column], kind[row + 1, column]  # pixels at the border are dark
    return bool(above == below == kind[row, column - 1] == kind[row, column + 1] == WHOLE)


@njit(cache=True, nogil=True)
def _of_cell(
    x: FloatArray,
    y: FloatArray,
    channel: IndexArray,
    own: CellWeights,
    light: Light,
    h: float,
    ratios: FloatArray,
    alike: bool,
    found: FloatArray,
) -> None:
    """`deviations` of one cell. `ratios`: of `_ratios`; `alike`: whether pixels with the same weight in the whole cell
    have the same one, and give it alike to the channels.
    """
    kind, weights, changes = own.kind, own.high, own.change
    table, per_px, half, radius, share = light.table, light.per_px, light.half, light.radius, light.share
    n, blurred, last = len(ratios), table.shape[1] > 0, table.shape[1] - 1.0
    high, does_change, change = np.empty(n), np.empty(n, dtype=np.bool_), np.empty((n, N_CHANGES))
    room, nodes = room_for_radii()
    seen, apart, deep = np.zeros((N_SEEN, BOUNDED)), np.empty(BOUNDED), np.zeros((n, BOUNDED))
    flat = found.reshape(n * n, -1)
    smooth = BOTH_AXES * THIRD * h**3 / half
    found[:] = 0.0
    for row in range(y.size):
        for column in range(x.size):
            dx, dy, to = x[column], y[row], channel[row, column]
            if alike and _is_deep(kind, row, column, share):
                inner = int(min(math.sqrt(dx * dx + dy * dy) * per_px + 0.5, last))
                add_row(smooth, table, INNER, inner, deep, to)
                continue
            some, at_rim = _mix(kind, weights, changes, channel, row, column, share, high, does_change, change)
            if not some:
                continue
            if not blurred:
                of_sharp(dx, dy, half, radius, h, seen)
                _add_sharp(high, does_change, change, to, seen, ratios, h, found)
                continue
            if at_rim:  # little of the light of a pixel beside one at the rim has a weight that changes
                of_blurred(dx, dy, half, h, table, per_px, kind[row, column] == RIM, room, nodes, seen)
            inner = int(min(math.sqrt(dx * dx + dy * dy) * per_px + 0.5, last))
            for u in range(n):
                if high[u] <= 0:  # no part of the cell gives it one
                    continue
                if does_change[u]:
                    _add_rim(high[u], change, u, to, seen, ratios, h, apart, found)
                else:
                    add_row(high[u] * smooth, table, INNER, inner, flat, u * n + to)
    for u in range(n):
        for to in range(n):
            add(found[u, to], light.taken[to, u], deep[to])


@njit(cache=True, nogil=True)
def deviations(
    x: FloatArray,
    y: FloatArray,
    channel: IndexArray,
    given: FloatArray,
    light: Light,
    readout: float,
    h: float,
    nodes: FloatArray,
    found: FloatArray,
    moves: FloatArray,
) -> None:
    """How far the weighted light less that share of the weights which it is at the nodes may be, in cells of half width
    `h`, from the interpolation through its values there: see `compiled_areas`.

    `given`: the weights of pixels, where they are the same in a whole cell, ndarray[n_cells, n_rows, n_columns], else
    none: they are those of a mean over a disc of the radius `readout`. `nodes`: range of each part of the kernel there,
    ndarray[n_cells, 2, n_channels, n_channels, BOUNDED]. `found`: ndarray[n_cells, n_channels, n_channels, BOUNDED];
    `moves`: how far the sum of the weights, times a parabola, may be, ndarray[n_cells, n_channels, 3].
    """
    shape, n_channels = channel.shape, found.shape[1]
    own = CellWeights(np.empty(shape, dtype=np.int64), np.empty(shape), np.empty((*shape, N_CHANGES)))
    ratios = np.empty((n_channels, n_channels, 2, BOUNDED))
    alike = light.even and len(given) == 0 and light.table.shape[1] > 0
    for cell in range(len(x)):
        if len(given):
            moves[cell] = 0.0
            _given(given[cell], own)
        else:
            areas(x[cell], y[cell], channel, light.half, readout, h, own, moves[cell])
        _ratios(nodes[cell], light.taken, ratios)
        _of_cell(x[cell], y[cell], channel, own, light, h, ratios, alike, found[cell])


@njit(cache=True, nogil=True, fastmath=_FINITE)
def ranges(values: FloatArray, middle: int, ends: IndexArray, found: FloatArray) -> None:
    """Put the smallest and largest of values, ndarray[n, n_knots], at the middle knot, and of what differs from it in
    each band from one of `ends` to the next into `found`, ndarray[2, n, n_parts].
    """
    for at in range(len(values)):
        own = values[at]
        found[:, at, 0] = own[middle]
        for band in range(1, ends.size):
            least, most = np.inf, -np.inf
            for knot in range(ends[band - 1], ends[band] + 1):
                least, most = min(least, own[knot]), max(most, own[knot])
            found[0, at, band], found[1, at, band] = least - own[middle], most - own[middle]
