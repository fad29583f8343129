"""Non-dominated sets."""

from __future__ import annotations

import numpy as np

from ..base.types import BoolArray, FloatArray


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
    if keep.any():
        front[keep] = moocore.is_nondominated(values[keep], maximise=True, keep_weakly=True)
    return front
