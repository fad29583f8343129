"""Compiled inner loop of the distances in cells of places. It releases the GIL."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..base.machine_code import njit
from ..base.types import BoolArray, FloatArray, IndexArray
from .compiled_patches import N_CONTROL, PARTS, largest_derivatives, to_control, to_parts

_N_NODES = 9
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


@njit(cache=True, nogil=True, fastmath=_FINITE)
def _left_over(
    values: FloatArray, control: FloatArray, rest: FloatArray, moves: FloatArray, h: float, left: FloatArray
) -> None:
    """Put how far the difference of two signals may be from its patch into `left`, ndarray[n_channels].

    `values`, `control`: ndarray[n_channels, 9]; `rest`: ndarray[n_channels], `moves`: ndarray[n_channels, 3].
    """
    for u in range(left.size):
        mean, least, most = 0.0, control[u, 0], control[u, 0]
        for at in range(_N_NODES):
            mean += values[u, at] / _N_NODES
            least, most = min(least, control[u, at]), max(most, control[u, at])
        slope, bend = largest_derivatives(control[u], h)
        left[u] = rest[u] + moves[u, 0] * max(most - mean, mean - least) + moves[u, 1] * slope + moves[u, 2] * bend


@njit(cache=True, nogil=True)
def _divided(every: FloatArray, lefts: FloatArray, some: BoolArray, low: FloatArray, nearest: float) -> float:
    """Bound the distances of some pairs from the parts of their patches: put the lower ones into `low`, ndarray[
    n_pairs], and return the least upper one.

    `every`: values at the nodes, ndarray[n_pairs, n_channels, 9]; `lefts`: ndarray[n_pairs, n_channels].
    """
    n_pairs, n_channels = lefts.shape
    half_way, control = np.empty((3, N_CONTROL)), np.empty((n_channels, N_CONTROL, N_CONTROL))
    part, (along, squared) = np.empty((n_channels, _N_NODES)), np.empty((2, _N_NODES))
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
                below, most = _bounds(part, lefts[pair], along, squared)
                least, above[row, column] = min(least, below), min(above[row, column], most)
        low[pair] = max(low[pair], least)
    return min(nearest, float(above.max()))


@njit(cache=True, nogil=True, fastmath=_FINITE)
def _differences(one: FloatArray, other: FloatArray, found: FloatArray, squared: FloatArray) -> None:
    """Put the difference of two signals at the nodes, ndarray[n_channels, 9], and the square of its length there."""
    squared[:] = 0.0
    for u in range(len(one)):
        for node in range(_N_NODES):
            away = one[u, node] - other[u, node]
            found[u, node] = away
            squared[node] += away * away


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
    n_channels, n_pairs = seen.shape[1], pairs[0].size
    values = np.empty((n_pairs, n_channels, _N_NODES))
    control, lefts = np.empty((n_channels, _N_NODES)), np.empty((n_pairs, n_channels))
    some, (along, squared) = np.empty(n_pairs, dtype=np.bool_), np.empty((2, _N_NODES))
    own = np.empty((seen.shape[2], n_channels, _N_NODES))
    for cell in range(len(at)):
        for node in range(_N_NODES):
            for u in range(n_channels):
                for signal in range(seen.shape[2]):
                    own[signal, u, node] = seen[at[cell, node], u, signal]
        nearest = math.inf
        shortest = np.full(_N_NODES, np.inf)
        for pair in range(n_pairs):
            _differences(own[pairs[0][pair]], own[pairs[1][pair]], values[pair], squared)
            for node in range(_N_NODES):
                shortest[node] = min(shortest[node], squared[node])
            for u in range(n_channels):
                to_control(values[pair, u], control[u])
            _left_over(values[pair], control, rest[cell, :, pair], moves[cell], h, lefts[pair])
            found.low[cell, pair], most = _bounds(control, lefts[pair], along, squared)
            nearest = min(nearest, most)
        found.nodes[cell] = np.sqrt(shortest)
        if found.low[cell].min() < ends[0] or nearest > ends[1]:
            for pair in range(n_pairs):
                some[pair] = found.low[cell, pair] <= nearest
            if some.sum() <= _MOST_DIVIDED:
                nearest = _divided(values, lefts, some, found.low[cell], nearest)
        found.nearest[cell] = nearest
