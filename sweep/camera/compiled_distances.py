"""Compiled inner loop of the distances in cells of places. It releases the GIL."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from ..base.types import FloatArray, IndexArray


@njit(cache=True, nogil=True)
def distances(
    seen: FloatArray, at: IndexArray, pairs: tuple[IndexArray, IndexArray], rest: FloatArray, tilt: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Of cells: the lower bound of the distance of each pair of signals, ndarray[n_cells, n_pairs], the least of their
    upper bounds, ndarray[n_cells], and the smallest distance at each corner, ndarray[n_cells, n_corners].

    `seen`: what channels see of all signals at places, ndarray[n_places, n_channels, n_signals]; `at`: the places at
    the corners of each cell, ndarray[n_cells, n_corners]. `pairs`: two signals each. `rest`: how far their difference
    may be from a mean of those at the corners, ndarray[n_cells, n_channels, n_pairs]; `tilt`: see `Deviation`.
    """
    n, n_corners = at.shape
    n_channels = seen.shape[1]
    low, nearest = np.empty((n, pairs[0].size)), np.full(n, np.inf)
    corners = np.full((n, n_corners), np.inf)
    apart, left, towards = np.empty((n_corners, n_channels)), np.empty(n_channels), np.empty(n_channels)
    for cell in range(n):
        for pair in range(pairs[0].size):
            one, other = pairs[0][pair], pairs[1][pair]
            beside = length = furthest = 0.0
            for u in range(n_channels):
                total, least, most = 0.0, np.inf, -np.inf
                for corner in range(n_corners):
                    place = at[cell, corner]
                    away = seen[place, u, one] - seen[place, u, other]
                    apart[corner, u] = away
                    total, least, most = total + away, min(least, away), max(most, away)
                left[u] = rest[cell, u, pair] + tilt[cell, u] * (most - least) / 2
                towards[u] = total / n_corners
                beside += left[u] ** 2
                length += towards[u] ** 2
            beyond = np.inf
            for corner in range(n_corners):
                along = squared = 0.0
                for u in range(n_channels):
                    squared += apart[corner, u] ** 2
                    along += apart[corner, u] * towards[u]
                corners[cell, corner] = min(corners[cell, corner], math.sqrt(squared))
                furthest, beyond = max(furthest, squared), min(beyond, along)
            for u in range(n_channels):
                beyond -= abs(towards[u]) * left[u]
            low[cell, pair] = max(beyond / math.sqrt(length), 0.0) if length > 0 else 0.0
            nearest[cell] = min(nearest[cell], math.sqrt(furthest) + math.sqrt(beside))
    return low, nearest, corners
