"""Non-dominated sets."""

from __future__ import annotations

import numpy as np

from ..base.types import Array, Bool, BoolArray, Float


def knee(values: Float[Array, "points 2"]) -> int | None:
    """Return the knee of a front: the point farthest beyond the line between its ends.

    None for fewer than three different points, or if none is beyond the line.
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


def non_dominated(
    values: Float[Array, "points objectives"], eligible: Bool[BoolArray, " points"] | None = None
) -> Bool[BoolArray, " points"]:
    """Return the rows that no other eligible row dominates.

    `eligible`: rows that may be in the set; other rows, and rows with NaN, dominate nothing. True for non-dominated
    rows. Equal rows are all kept.
    """
    import moocore  # noqa: PLC0415  (pulls in pandas: kept off the start-up path)

    keep = np.logical_and.reduce([np.isfinite(column) for column in values.T])
    if eligible is not None:
        keep &= eligible
    front = np.zeros(len(values), dtype=bool)
    if keep.any():
        front[keep] = moocore.is_nondominated(values[keep], maximise=True, keep_weakly=True)
    return front
