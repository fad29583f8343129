"""How far pairs of signals move, and which of them can be nearest: in NumPy for a few cells, compiled for many.

A process that bounds a few cells alone need not load what runs machine code, which takes longer than the bounds do.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ...base.types import FloatArray, IndexArray

Parts = tuple[FloatArray, FloatArray, FloatArray]
"""What each signal is, ndarray[n_cases, n_values, n_signals]; by how much the difference of each pair may be off,
ndarray[n_cases, n_values, n_pairs]; and by how much more in a cell of places, ndarray[n_cells, n_values, n_pairs]."""
_FEW = 1_000_000
"""Differences of pairs up to which NumPy takes less than loading machine code does."""


def longest_moves(change: Parts, corners: IndexArray, first: IndexArray, second: IndexArray) -> FloatArray:
    """How far the difference of each pair moves at most in each cell of places, ndarray[n_cells, n_pairs].

    `change`: what changes. `corners`: the cases at the corners of each cell, ndarray[n_cells, n_corners]. `first`,
    `second`: the signals of each pair.
    """
    if _many(change, corners, first):
        from .compiled import moves_of_cells  # noqa: PLC0415  (slow to load: only where much is to be done)

        moves: FloatArray = moves_of_cells(change, corners, first, second)
        return moves
    return np.asarray(_lengths(change, corners, first, second, 1.0).max(axis=1, initial=0.0))


def largest_change(
    moves: FloatArray,
    after: Parts,
    corners: IndexArray,
    first: IndexArray,
    second: IndexArray,
    ends: IndexArray,
    shortened: float,
    least: float,
) -> float:
    """Largest change of the smallest distance of any group of pairs, in any cell of places; `least` where it is less.

    `moves`: of `longest_moves`; `after`: what is left. `ends`: where each group of pairs begins, and the end.
    `shortened`: how much shorter the smallest possible distance is.
    """
    if _many(after, corners, first):
        from .compiled import change_of_cells  # noqa: PLC0415  (slow to load: only where much is to be done)

        return float(change_of_cells(moves, after, corners, first, second, ends, shortened, least))
    far = moves[:, None]
    low = shortened * _lengths(after, corners, first, second, -1.0) - far
    high = _lengths(after, corners, first, second, 1.0) + far
    worst = least
    for begin, end in pairwise(ends):
        nearest = high[..., begin:end].min(axis=-1, keepdims=True, initial=np.inf)
        can_be = (low[..., begin:end] <= nearest).any(axis=1)
        worst = max(worst, float(moves[:, begin:end].max(where=can_be, initial=0.0)))
    return worst


def _many(parts: Parts, corners: IndexArray, first: IndexArray) -> bool:
    """Whether there are many differences of pairs."""
    return int(corners.size * parts[0].shape[1] * first.size) > _FEW


def _lengths(parts: Parts, corners: IndexArray, first: IndexArray, second: IndexArray, sign: float) -> FloatArray:
    """Largest (`sign` 1) or smallest (-1) length of each pair's difference, ndarray[n_cells, n_corners, n_pairs]."""
    seen, wide, between = parts
    apart = np.abs(seen[..., first] - seen[..., second])[corners] + sign * (wide[corners] + between[:, None])
    return np.asarray(np.sqrt((np.maximum(apart, 0.0) ** 2).sum(axis=-2)))
