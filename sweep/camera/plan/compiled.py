"""Compiled inner loops of the bounds on how much an effect can change a CSD. They release the GIL."""

from __future__ import annotations

import numpy as np

from ...base.machine_code import njit
from ...base.types import FloatArray, IndexArray


@njit(cache=True, nogil=True)
def _lengths(
    seen: FloatArray,
    first: IndexArray,
    second: IndexArray,
    wide: FloatArray,
    between: FloatArray,
    sign: float,
    scale: float,
    out: FloatArray,
) -> None:
    """Largest (`sign` 1) or smallest (-1) length of each pair's difference, times `scale`.

    `seen`: ndarray[n_values, n_signals]. A pair's values differ by as much as its two signals, give or take `wide` and
    `between`, ndarray[n_values, n_pairs] each. `out`: ndarray[n_pairs].
    """
    out[:] = 0.0
    for v in range(seen.shape[0]):
        for p in range(first.size):
            one = max(abs(seen[v, first[p]] - seen[v, second[p]]) + sign * (wide[v, p] + between[v, p]), 0.0)
            out[p] += one * one
    for p in range(first.size):
        out[p] = scale * np.sqrt(out[p])


@njit(cache=True, nogil=True)
def moves_of_cells(
    change: tuple[FloatArray, FloatArray, FloatArray], corners: IndexArray, first: IndexArray, second: IndexArray
) -> FloatArray:
    """`moves.longest_moves` of many cells."""
    one = np.empty(first.size)
    far = np.zeros((corners.shape[0], first.size))
    for cell in range(corners.shape[0]):
        for case in corners[cell]:
            _lengths(change[0][case], first, second, change[1][case], change[2][cell], 1.0, 1.0, one)
            for p in range(first.size):
                far[cell, p] = max(far[cell, p], one[p])
    return far


@njit(cache=True, nogil=True)
def change_of_cells(
    moves: FloatArray,
    after: tuple[FloatArray, FloatArray, FloatArray],
    corners: IndexArray,
    first: IndexArray,
    second: IndexArray,
    ends: IndexArray,
    shortened: float,
    least: float,
) -> float:
    """`moves.largest_change` of many cells."""
    low, high = np.zeros(first.size), np.zeros(first.size)
    worst = least
    for cell in range(corners.shape[0]):
        far = moves[cell]
        for case in corners[cell]:
            _lengths(after[0][case], first, second, after[1][case], after[2][cell], -1.0, shortened, low)
            _lengths(after[0][case], first, second, after[1][case], after[2][cell], 1.0, 1.0, high)
            for group in range(ends.size - 1):
                nearest = np.inf
                for p in range(ends[group], ends[group + 1]):
                    nearest = min(nearest, high[p] + far[p])
                for p in range(ends[group], ends[group + 1]):
                    if far[p] > worst and low[p] - far[p] <= nearest:
                        worst = far[p]
    return worst
