"""Compiled inner loops of the search for the worst place: what is still open once cells are bounded. They release the
GIL."""

from __future__ import annotations

import numpy as np

from ..base.machine_code import njit
from ..base.types import BoolArray, FloatArray


@njit(cache=True, nogil=True)
def ends_of(values: FloatArray) -> tuple[int, int]:
    """Where the smallest and the largest of some values are, the first of equal ones, ndarray[n, m] read row by row."""
    flat = values.reshape(-1)
    low = high = 0
    for at in range(1, flat.size):
        if flat[at] < flat[low]:
            low = at
        if flat[at] > flat[high]:
            high = at
    return low, high


@njit(cache=True, nogil=True)
def still_open(low: FloatArray, nearest: FloatArray, below: float, above: float) -> tuple[BoolArray, BoolArray]:
    """Which cells may hold a distance below or above some, and which pairs may be the nearest in any of them.

    `low`: lower bound of the distance of each pair in each cell, ndarray[n_cells, n_pairs]; `nearest`: the least of
    their upper bounds, ndarray[n_cells].
    """
    cells, pairs = np.empty(len(low), dtype=np.bool_), np.zeros(low.shape[1], dtype=np.bool_)
    for cell in range(len(low)):
        cells[cell] = nearest[cell] > above or low[cell].min() < below
        if cells[cell]:
            for pair in range(low.shape[1]):
                if low[cell, pair] <= nearest[cell]:
                    pairs[pair] = True
    return cells, pairs
