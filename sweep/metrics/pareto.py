"""Non-dominated sets."""

from __future__ import annotations

import numpy as np

from ..base.types import BoolArray, FloatArray, IndexArray

_MANY, _BINS = 4096, 256
"""Rows from which on it pays to leave those out that coarse bins show to be dominated, and how many bins."""


def hypervolume(values: FloatArray, reference: FloatArray) -> float:
    """Volume that rows of ndarray[n, n_objectives], all maximized, dominate above `reference`."""
    import moocore  # noqa: PLC0415  (pulls in pandas: kept off the start-up path)

    inside = np.isfinite(values).all(axis=1) & (values > reference).all(axis=1)
    return float(moocore.hypervolume(values[inside], ref=reference, maximise=True)) if inside.any() else 0.0


def knee(values: FloatArray) -> int | None:
    """Row of a front, ndarray[n, 2], that is farthest beyond the straight line between the front's ends.

    Both quantities are maximized and scaled to the front's own range. None for fewer than three different points, or
    where none is beyond the line.
    """
    if len(values) < 3 or not np.isfinite(values).all():
        return None
    span = np.ptp(values, axis=0)
    if not (span > 0).all():
        return None
    scaled = (values - values.min(axis=0)) / span  # the line between the ends is then x + y = 1
    beyond = scaled.sum(axis=1) - 1.0
    best = int(np.argmax(beyond))
    return best if beyond[best] > 1e-9 else None


def non_dominated(values: FloatArray, eligible: BoolArray | None = None) -> BoolArray:
    """Return which rows of ndarray[n, n_objectives], all maximized, no other eligible row dominates: bool ndarray[n].

    Rows with a NaN and rows that are not `eligible` are never in the set and dominate nothing. Rows that are equal
    in every objective are all kept.
    """
    import moocore  # noqa: PLC0415  (pulls in pandas: kept off the start-up path)

    keep = np.logical_and.reduce([np.isfinite(column) for column in values.T])
    if eligible is not None:
        keep &= eligible
    front = np.zeros(len(values), dtype=bool)
    some = np.flatnonzero(keep)
    if some.size > _MANY and values.shape[1] == 2:
        some = some[_undecided(values[some])]
    if some.size:
        front[some] = moocore.is_nondominated(values[some], maximise=True, keep_weakly=True)
    return front


def _undecided(values: FloatArray) -> IndexArray:
    """Which rows of ndarray[n, 2], finite, may not be dominated: the others have less of both than a row in a bin
    beyond theirs.
    """
    first, second = np.ascontiguousarray(values.T)
    with np.errstate(over="ignore", divide="ignore"):
        per_unit = (_BINS - 1) / np.ptp(first)
    if not 0 < per_unit < np.inf:
        return np.arange(len(values))
    at = ((first - first.min()) * per_unit).astype(np.intp)
    best = np.full(_BINS + 1, -np.inf)
    np.maximum.at(best, at, second)
    from_here_on = np.maximum.accumulate(best[::-1])[::-1]
    return np.flatnonzero(second >= from_here_on[at + 1])
