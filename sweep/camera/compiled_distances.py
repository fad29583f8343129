"""Compiled inner loop of the distances in cells of places. It releases the GIL."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from ..base.types import BoolArray, FloatArray, IndexArray
from .compiled_patches import N_CONTROL, PARTS, largest_derivatives, to_control, to_parts

_N_NODES = 9
_MOST_DIVIDED = 16
"""Pairs of a cell whose patches are divided."""


class Distances(NamedTuple):
    """Of cells: the lower bound of the distance of each pair of signals, ndarray[n_cells, n_pairs], the least of their
    upper bounds, ndarray[n_cells], and the smallest distance at each node, ndarray[n_cells, 9].
    """

    low: FloatArray
    nearest: FloatArray
    nodes: FloatArray


@njit(cache=True, nogil=True)
def _bounds(control: FloatArray, left: FloatArray) -> tuple[float, float]:
    """Of the length of a vector that is in the hull of some points (ndarray[n_channels, n]), but for `left` in each
    channel: it is at least how far all points lie to one side of a plane, less what is left, and at most the length of
    the longest and what is left.
    """
    n_channels, n = control.shape
    beside = length = furthest = beyond_left = 0.0
    for u in range(n_channels):
        towards = control[u, n // 2]
        length += towards**2
        beside += left[u] ** 2
        beyond_left += abs(towards) * left[u]
    beyond = math.inf
    for at in range(n):
        along = squared = 0.0
        for u in range(n_channels):
            squared += control[u, at] ** 2
            along += control[u, at] * control[u, n // 2]
        furthest, beyond = max(furthest, squared), min(beyond, along)
    low = max((beyond - beyond_left) / math.sqrt(length), 0.0) if length > 0 else 0.0
    return low, math.sqrt(furthest) + math.sqrt(beside)


@njit(cache=True, nogil=True)
def _left_over(
    values: FloatArray, control: FloatArray, rest: FloatArray, moves: FloatArray, h: float, left: FloatArray
) -> None:
    """Put how far the difference of two signals may be from its patch into `left`, ndarray[n_channels].

    `values`, `control`: ndarray[n_channels, 9]; `rest`: ndarray[n_channels], `moves`: ndarray[n_channels, 3].
    """
    for u in range(left.size):
        mean = values[u].mean()
        size = max(control[u].max() - mean, mean - control[u].min())
        slope, bend = largest_derivatives(control[u], h)
        left[u] = rest[u] + moves[u, 0] * size + moves[u, 1] * slope + moves[u, 2] * bend


@njit(cache=True, nogil=True)
def _divided(every: FloatArray, lefts: FloatArray, some: BoolArray, low: FloatArray, nearest: float) -> float:
    """Bound the distances of some pairs from the parts of their patches: put the lower ones into `low`, ndarray[
    n_pairs], and return the least upper one.

    `every`: values at the nodes, ndarray[n_pairs, n_channels, 9]; `lefts`: ndarray[n_pairs, n_channels].
    """
    n_pairs, n_channels = lefts.shape
    half_way, control = np.empty((3, N_CONTROL)), np.empty((n_channels, N_CONTROL, N_CONTROL))
    part = np.empty((n_channels, _N_NODES))
    above = np.full((PARTS, PARTS), np.inf)
    for pair in range(n_pairs):
        if not some[pair]:
            continue
        for u in range(n_channels):
            to_parts(every[pair, u], half_way, control[u])
        least = math.inf
        for row in range(PARTS):
            for column in range(PARTS):
                for u in range(n_channels):
                    for at in range(_N_NODES):
                        part[u, at] = control[u, 2 * row + at // 3, 2 * column + at % 3]
                below, most = _bounds(part, lefts[pair])
                least, above[row, column] = min(least, below), min(above[row, column], most)
        low[pair] = max(low[pair], least)
    return min(nearest, float(above.max()))


@njit(cache=True, nogil=True)
def distances(
    seen: FloatArray,
    at: IndexArray,
    pairs: tuple[IndexArray, IndexArray],
    rest: FloatArray,
    moves: FloatArray,
    h: float,
    ends: tuple[float, float],
    found: Distances,
) -> None:
    """Bound the distances in cells of half width `h`.

    `seen`: what channels see of all signals at places, ndarray[n_places, n_channels, n_signals]; `at`: the places at
    the nodes of each cell, ndarray[n_cells, 9]. `pairs`: two signals each. `rest`: how far their difference may be from
    its interpolation, ndarray[n_cells, n_channels, n_pairs]; `moves`: see `Deviation`. `ends`: a cell in which no
    distance is below the first of these, and at every place one is not above the second, is not looked at more closely.
    """
    n_channels, n_pairs = seen.shape[1], pairs[0].size
    values = np.empty((n_pairs, n_channels, _N_NODES))
    control, lefts = np.empty((n_channels, _N_NODES)), np.empty((n_pairs, n_channels))
    some = np.empty(n_pairs, dtype=np.bool_)
    for cell in range(len(at)):
        nearest = math.inf
        found.nodes[cell] = math.inf
        for pair in range(n_pairs):
            one, other = pairs[0][pair], pairs[1][pair]
            for node in range(_N_NODES):
                squared, place = 0.0, at[cell, node]
                for u in range(n_channels):
                    away = seen[place, u, one] - seen[place, u, other]
                    values[pair, u, node] = away
                    squared += away**2
                found.nodes[cell, node] = min(found.nodes[cell, node], math.sqrt(squared))
            for u in range(n_channels):
                to_control(values[pair, u], control[u])
            _left_over(values[pair], control, rest[cell, :, pair], moves[cell], h, lefts[pair])
            found.low[cell, pair], most = _bounds(control, lefts[pair])
            nearest = min(nearest, most)
        if found.low[cell].min() < ends[0] or nearest > ends[1]:
            for pair in range(n_pairs):
                some[pair] = found.low[cell, pair] <= nearest
            if some.sum() <= _MOST_DIVIDED:
                nearest = _divided(values, lefts, some, found.low[cell], nearest)
        found.nearest[cell] = nearest
