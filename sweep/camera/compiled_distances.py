"""Compiled inner loop of the distances in cells of places. It releases the GIL."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..base.machine_code import njit
from ..base.types import FloatArray, IndexArray
from .compiled_patches import N_CONTROL, PARTS, to_parts

_N_NODES = 9
ABREAST = 16
"""Pairs that are bounded together: loops over them have so many rounds, which is known when they are compiled."""
_SQUARES, _ALONG, _LENGTHS, _SUMS, _LEFT, _LOW, _MOST, _ROOM = 9, 18, 27, 36, 39, 40, 41, 42
"""Where what is known of these pairs stands, behind their control points: in one array, so that all these numbers are
known when it is compiled."""
_MOST_DIVIDED = 16
"""Pairs of a cell whose patches are divided."""


class CellDistances(NamedTuple):
    """Of cells: the lower bound of the distance of each pair of signals, ndarray[n_cells, n_pairs], the least of their
    upper bounds, ndarray[n_cells], and the smallest distance at each node, ndarray[n_cells, 9].
    """

    low: FloatArray
    nearest: FloatArray
    nodes: FloatArray


_FINITE = {"contract", "nnan", "nsz"}


@njit(cache=True, nogil=True)
def amounts_of_pairs(
    light: FloatArray, first: IndexArray, second: IndexArray, band: IndexArray, found: FloatArray
) -> None:
    """Put the size of the difference of two lights, in all and by the band of each wavelength, into `found`,
    ndarray[n_pairs, n_channels, n_parts], which is nothing before; all alone where there is one part.

    `light`: ndarray[n, n_channels, n_wavelengths]; `band`: the part of each wavelength.
    """
    for pair in range(first.size):
        for u in range(light.shape[1]):
            one, other, own = light[first[pair], u], light[second[pair], u], found[pair, u]
            total = 0.0
            for at in range(band.size):
                away = one[at] - other[at]
                total += away
                if own.size > 1:
                    own[band[at]] += abs(away)
            own[0] = abs(total)


@njit(cache=True, nogil=True, fastmath=_FINITE)
def _bounds(control: FloatArray, left: FloatArray, along: FloatArray, squared: FloatArray) -> tuple[float, float]:
    """Of the length of a vector that is in the hull of some points (ndarray[n_channels, n]), but for `left` in each
    channel: it is at least how far all points lie to one side of a plane, less what is left, and at most the length of
    the longest and what is left. `along`, `squared`: ndarray[n], to work in.
    """
    n_channels, n = control.shape
    beside = length = beyond_left = 0.0
    along[:], squared[:] = 0.0, 0.0
    for u in range(n_channels):
        towards, own = control[u, n // 2], control[u]
        length += towards**2
        beside += left[u] ** 2
        beyond_left += abs(towards) * left[u]
        for at in range(n):
            along[at] += own[at] * towards
            squared[at] += own[at] * own[at]
    beyond, furthest = along[0], squared[0]
    for at in range(1, n):
        furthest, beyond = max(furthest, squared[at]), min(beyond, along[at])
    low = max((beyond - beyond_left) / math.sqrt(length), 0.0) if length > 0 else 0.0
    return low, math.sqrt(furthest) + math.sqrt(beside)


@njit(cache=True, nogil=True)
def _divided(every: FloatArray, lefts: FloatArray, low: FloatArray, nearest: float) -> float:
    """Bound the distances of pairs from the parts of their patches: put the lower ones, where they are larger, into
    `low`, ndarray[n_pairs], and return the least upper one.

    `every`: values at the nodes, ndarray[n_pairs, n_channels, 9]; `lefts`: ndarray[n_pairs, n_channels].
    """
    n_pairs, n_channels = lefts.shape
    half_way, control = np.empty((3, N_CONTROL)), np.empty((n_channels, N_CONTROL, N_CONTROL))
    part, (along, squared) = np.empty((n_channels, _N_NODES)), np.empty((2, _N_NODES))
    above = np.full((PARTS, PARTS), np.inf)
    for pair in range(n_pairs):
        for u in range(n_channels):
            to_parts(every[pair, u], half_way, control[u])
        least = math.inf
        for row in range(PARTS):
            for column in range(PARTS):
                for u in range(n_channels):
                    for at in range(_N_NODES):
                        part[u, at] = control[u, 2 * row + at // 3, 2 * column + at % 3]
                below, most = _bounds(part, lefts[pair], along, squared)
                least, above[row, column] = min(least, below), min(above[row, column], most)
        low[pair] = max(low[pair], least)
    return min(nearest, float(above.max()))


@njit(cache=True, nogil=True, fastmath=_FINITE)
def _take_lanes(own: FloatArray, one: IndexArray, other: IndexArray, start: int, values: FloatArray) -> None:
    """Put the differences of some pairs, channel by channel and node by node, into `values`, ndarray[9 n_channels
    ABREAST].

    `own`: of all signals, ndarray[n_signals, 9 n_channels]. Where less pairs are left than lanes, the last one counts
    again.
    """
    last, n = one.size - 1, own.shape[1]
    for lane in range(ABREAST):
        pair = min(start + lane, last)
        here, there, to = own[one[pair]], own[other[pair]], values[lane:]
        for at in range(n):
            to[at * ABREAST] = here[at] - there[at]


@njit(cache=True, nogil=True, fastmath=_FINITE)
def _add_channel(values: FloatArray, rest: FloatArray, moves: FloatArray, h: float, room: FloatArray) -> None:
    """Add what a channel has of the bounds of some pairs to `room`, ndarray[_ROOM ABREAST].

    There are its control points (`compiled_patches.to_control`), how far the differences may be from their patches
    (`_LEFT`), and sums over the channels: the squares of the lengths at the nodes and of the control points, how far
    these are along the middle one, the square of that, of what is left, and the product of both sizes (`_SUMS`).

    `values`: ndarray[9 ABREAST], `rest`: ndarray[ABREAST]; `moves`: ndarray[3], for the size of a patch its largest
    slope and second derivative.
    """
    of_size, of_slope, of_bend = moves[0], moves[1] / h, moves[2] / (2 * h**2)
    for k in range(ABREAST):
        a, b, c = values[k], values[ABREAST + k], values[2 * ABREAST + k]
        d, e, f = values[3 * ABREAST + k], values[4 * ABREAST + k], values[5 * ABREAST + k]
        g, i, j = values[6 * ABREAST + k], values[7 * ABREAST + k], values[8 * ABREAST + k]
        mean = (a + b + c + d + e + f + g + i + j) / _N_NODES
        b, e, i = 2 * b - (a + c) / 2, 2 * e - (d + f) / 2, 2 * i - (g + j) / 2
        d, e, f = 2 * d - (a + g) / 2, 2 * e - (b + i) / 2, 2 * f - (c + j) / 2
        least = min(a, b, c, d, e, f, g, i, j)
        most = max(a, b, c, d, e, f, g, i, j)
        slope = max(abs(b - a), abs(c - b), abs(e - d), abs(f - e))
        slope = max(slope, abs(i - g), abs(j - i), abs(d - a), abs(g - d))
        slope = max(slope, abs(e - b), abs(i - e), abs(f - c), abs(j - f))
        bend = max(abs(c - 2 * b + a), abs(f - 2 * e + d), abs(j - 2 * i + g))
        bend = max(bend, abs(g - 2 * d + a), abs(i - 2 * e + b), abs(j - 2 * f + c))
        left = rest[k] + of_size * max(most - mean, mean - least) + of_slope * slope + of_bend * bend
        room[_LEFT * ABREAST + k] = left
        room[_SUMS * ABREAST + k] += e * e
        room[(_SUMS + 1) * ABREAST + k] += left * left
        room[(_SUMS + 2) * ABREAST + k] += abs(e) * left
        room[k], room[ABREAST + k], room[2 * ABREAST + k] = a, b, c
        room[3 * ABREAST + k], room[4 * ABREAST + k], room[5 * ABREAST + k] = d, e, f
        room[6 * ABREAST + k], room[7 * ABREAST + k], room[8 * ABREAST + k] = g, i, j
    for node in range(_N_NODES):
        own, seen, along = room[node * ABREAST :], values[node * ABREAST :], room[(_ALONG + node) * ABREAST :]
        length, squared = room[(_LENGTHS + node) * ABREAST :], room[(_SQUARES + node) * ABREAST :]
        for k in range(ABREAST):
            along[k] += own[k] * room[4 * ABREAST + k]
        for k in range(ABREAST):
            length[k] += own[k] * own[k]
        for k in range(ABREAST):
            squared[k] += seen[k] * seen[k]


@njit(cache=True, nogil=True, fastmath=_FINITE)
def _end_lanes(room: FloatArray, shortest: FloatArray) -> None:
    """Put the bounds of the lengths of some pairs (`_bounds`) into `_LOW` and `_MOST` of what `_add_channel` has, and
    the squares of the lengths at the nodes into `shortest`, ndarray[9], where they are shorter.
    """
    for k in range(ABREAST):
        beyond, furthest = room[_ALONG * ABREAST + k], room[_LENGTHS * ABREAST + k]
        for node in range(1, _N_NODES):
            beyond = min(beyond, room[(_ALONG + node) * ABREAST + k])
            furthest = max(furthest, room[(_LENGTHS + node) * ABREAST + k])
        length = math.sqrt(max(room[_SUMS * ABREAST + k], 1e-300))
        room[_LOW * ABREAST + k] = max((beyond - room[(_SUMS + 2) * ABREAST + k]) / length, 0.0)
        room[_MOST * ABREAST + k] = math.sqrt(furthest) + math.sqrt(room[(_SUMS + 1) * ABREAST + k])
    for node in range(_N_NODES):
        own = room[(_SQUARES + node) * ABREAST :]
        least = own[0]
        for k in range(1, ABREAST):
            least = min(least, own[k])
        shortest[node] = min(shortest[node], least)


@njit(cache=True, nogil=True)
def _of_pairs(
    own: FloatArray,
    one: IndexArray,
    other: IndexArray,
    rest: FloatArray,
    moves: FloatArray,
    h: float,
    room: FloatArray,
    values: FloatArray,
    lefts: FloatArray,
    low: FloatArray,
    shortest: FloatArray,
) -> float:
    """Bound the distances of all pairs in a cell: the lower bounds, what is left and the squares of the distances at
    the nodes go into the last three; the least of the upper bounds.
    """
    nearest, n = math.inf, _N_NODES * ABREAST
    some_rest = np.empty(ABREAST)
    for start in range(0, one.size, ABREAST):
        _take_lanes(own, one, other, start, values)
        some = min(ABREAST, one.size - start)
        room[:] = 0.0
        for u in range(len(rest)):
            for lane in range(ABREAST):
                some_rest[lane] = rest[u, min(start + lane, one.size - 1)]
            _add_channel(values[u * n :], some_rest, moves[u], h, room)
            for lane in range(some):
                lefts[u, start + lane] = room[_LEFT * ABREAST + lane]
        _end_lanes(room, shortest)
        for lane in range(some):
            low[start + lane] = room[_LOW * ABREAST + lane]
            nearest = min(nearest, room[_MOST * ABREAST + lane])
    return nearest


@njit(cache=True, nogil=True)
def _closer(
    own: FloatArray, one: IndexArray, other: IndexArray, lefts: FloatArray, low: FloatArray, nearest: float
) -> float:
    """`_divided` of the pairs of a cell that may be the nearest, where these are few."""
    some = low <= nearest
    if some.sum() > _MOST_DIVIDED:
        return nearest
    which, n_channels = np.flatnonzero(some), len(lefts)
    every, own_low = np.empty((which.size, n_channels, _N_NODES)), np.empty(which.size)
    few = np.empty((which.size, n_channels))
    for at in range(which.size):
        pair = which[at]
        own_low[at], few[at] = low[pair], lefts[:, pair]
        every[at] = (own[one[pair]] - own[other[pair]]).reshape(n_channels, _N_NODES)
    nearest = _divided(every, few, own_low, nearest)
    low[which] = own_low
    return nearest


@njit(cache=True, nogil=True)
def distances(
    seen: FloatArray,
    at: IndexArray,
    pairs: tuple[IndexArray, IndexArray],
    rest: FloatArray,
    moves: FloatArray,
    h: float,
    ends: tuple[float, float],
    found: CellDistances,
) -> None:
    """Bound the distances in cells of half width `h`.

    `seen`: what channels see of all signals at places, ndarray[n_places, n_channels, n_signals]; `at`: the places at
    the nodes of each cell, ndarray[n_cells, 9]. `pairs`: two signals each. `rest`: how far their difference may be from
    its interpolation, ndarray[n_cells, n_channels, n_pairs]; `moves`: see `Deviation`. `ends`: a cell that
    can hold neither a distance below the first of these nor one above the second is not looked at more closely.
    """
    (one, other), (lows, upper, at_nodes) = pairs, found
    n_channels, n_pairs = seen.shape[1], one.size
    own, values = np.empty((seen.shape[2], n_channels * _N_NODES)), np.empty(n_channels * _N_NODES * ABREAST)
    room, lefts, shortest = np.empty(_ROOM * ABREAST), np.empty((n_channels, n_pairs)), np.empty(_N_NODES)
    for cell in range(len(at)):
        for node in range(_N_NODES):
            here = seen[at[cell, node]]
            for signal in range(seen.shape[2]):
                for u in range(n_channels):
                    own[signal, u * _N_NODES + node] = here[u, signal]
        shortest[:] = math.inf
        low = lows[cell]
        nearest = _of_pairs(own, one, other, rest[cell], moves[cell], h, room, values, lefts, low, shortest)
        at_nodes[cell] = np.sqrt(shortest)
        if low.min() < ends[0] or nearest > ends[1]:
            nearest = _closer(own, one, other, lefts, low, nearest)
        upper[cell] = nearest
