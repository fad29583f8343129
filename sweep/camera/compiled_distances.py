"""Compiled inner loop of the distances in cells of places. It releases the GIL."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from ..types import FloatArray, IndexArray


@njit(cache=True, nogil=True)
def distances(
    first: FloatArray, second: FloatArray, pairs: tuple[IndexArray, IndexArray], rest: FloatArray, tilt: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Of cells and pairs of signals: the distance's lower and upper bound, ndarray[n_cells, n_pairs] each, and the
    distances at the corners, ndarray[n_cells, n_corners, n_pairs].

    `first`, `second`: what channels see of signals at the corners, ndarray[n_cells, n_corners, n_channels, n_signals].
    `pairs`: one of each. `rest`: how far their difference may be from a mean of those at the corners, ndarray[n_cells,
    n_channels, n_pairs]; `tilt`: see `Deviation`.
    """
    n, n_corners, n_channels = first.shape[:3]
    low, high = np.empty((2, n, pairs[0].size))
    corners = np.empty((n, n_corners, pairs[0].size))
    apart, left, towards = np.empty((n_corners, n_channels)), np.empty(n_channels), np.empty(n_channels)
    for cell in range(n):
        for pair in range(pairs[0].size):
            one, other = pairs[0][pair], pairs[1][pair]
            beside = length = furthest = 0.0
            for u in range(n_channels):
                total, least, most = 0.0, np.inf, -np.inf
                for corner in range(n_corners):
                    seen = first[cell, corner, u, one] - second[cell, corner, u, other]
                    apart[corner, u] = seen
                    total, least, most = total + seen, min(least, seen), max(most, seen)
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
                corners[cell, corner, pair] = math.sqrt(squared)
                furthest, beyond = max(furthest, squared), min(beyond, along)
            for u in range(n_channels):
                beyond -= abs(towards[u]) * left[u]
            low[cell, pair] = max(beyond / math.sqrt(length), 0.0) if length > 0 else 0.0
            high[cell, pair] = math.sqrt(furthest) + math.sqrt(beside)
    return low, high, corners
