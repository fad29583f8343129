"""Compiled inner loop of brightness curves: the point of a curve that is nearest to a reading.

It releases the GIL.
"""

from __future__ import annotations

import numpy as np

from ..base.machine_code import njit
from ..base.types import FloatArray, IndexArray

_STEPS = 2
_BLOCK = 8
"""Segments that are skipped together where none of them can be near."""


@njit(cache=True, nogil=True)
def _weight(first: float, second: float, least: float) -> float:
    """Return the inverse of the mean of two variances; 1 without noise."""
    if least <= 0.0:
        return 1.0
    return 1.0 / max(0.5 * (first + second), least)


@njit(cache=True, nogil=True)
def nearest_on_curves(  # noqa: PLR0912  (one pass over pairs, blocks, segments and channels)
    mean: FloatArray,
    variance: FloatArray,
    curve_mean: FloatArray,
    curve_variance: FloatArray,
    first: IndexArray,
    second: IndexArray,
    least: float,
    margin: float,
    nearest: float,
    squared: FloatArray,
    segment: IndexArray,
    share: FloatArray,
) -> None:
    """Find for each pair the point of a lamp's curve that is nearest to a reading.

    Between two nodes mean and variance are straight. With `least` above 0 distances are in units of the noise, the
    mean of both variances, at least so much; else in DN. Pairs that are farther than `margin` times the nearest squared
    distance of all, or times `nearest`, may be left out: their distance is infinite.

    `squared`, `share`: output: squared distance, and place of the nearest point in its segment, 0 to 1.
    """
    n_curves, n_nodes, n_channels = curve_mean.shape
    n_blocks = (n_nodes - 2) // _BLOCK + 1
    low, high = np.empty((n_curves, n_blocks, n_channels)), np.empty((n_curves, n_blocks, n_channels))
    noise = np.empty((n_curves, n_blocks, n_channels))
    is_second = np.zeros(n_curves, np.bool_)
    is_second[second] = True
    for curve in np.flatnonzero(is_second):
        for block in range(n_blocks):
            begin, end = block * _BLOCK, min(block * _BLOCK + _BLOCK, n_nodes - 1)
            for c in range(n_channels):
                low[curve, block, c] = high[curve, block, c] = curve_mean[curve, begin, c]
                noise[curve, block, c] = curve_variance[curve, begin, c]
                for node in range(begin + 1, end + 1):
                    low[curve, block, c] = min(low[curve, block, c], curve_mean[curve, node, c])
                    high[curve, block, c] = max(high[curve, block, c], curve_mean[curve, node, c])
                    noise[curve, block, c] = max(noise[curve, block, c], curve_variance[curve, node, c])
    for pair in range(first.size):
        point, spread, curve = mean[first[pair]], variance[first[pair]], second[pair]
        best = np.inf
        for block in range(n_blocks):
            bound = 0.0
            for c in range(n_channels):
                outside = max(low[curve, block, c] - point[c], point[c] - high[curve, block, c], 0.0)
                bound += outside * outside * _weight(spread[c], noise[curve, block, c], least)
            if bound >= min(best, margin * nearest):
                continue
            for node in range(block * _BLOCK, min(block * _BLOCK + _BLOCK, n_nodes - 1)):
                along = length = 0.0
                for c in range(n_channels):
                    step = curve_mean[curve, node + 1, c] - curve_mean[curve, node, c]
                    middle = 0.5 * (curve_variance[curve, node, c] + curve_variance[curve, node + 1, c])
                    weight = _weight(spread[c], middle, least)
                    along += (point[c] - curve_mean[curve, node, c]) * step * weight
                    length += step * step * weight
                inside = min(max(along / length, 0.0), 1.0) if length > 0.0 else 0.0
                for _ in range(_STEPS if least > 0.0 and length > 0.0 else 0):  # the noise changes along the segment
                    slope = bend = 0.0
                    for c in range(n_channels):
                        step = curve_mean[curve, node + 1, c] - curve_mean[curve, node, c]
                        difference = point[c] - curve_mean[curve, node, c] - inside * step
                        grows = curve_variance[curve, node + 1, c] - curve_variance[curve, node, c]
                        weight = _weight(spread[c], curve_variance[curve, node, c] + inside * grows, least)
                        slope -= (
                            2.0 * difference * step * weight + 0.5 * difference * difference * grows * weight * weight
                        )
                        bend += 2.0 * step * step * weight
                    inside = min(max(inside - slope / bend, 0.0), 1.0) if bend > 0.0 else inside
                for place in (inside, 0.0, 1.0) if least > 0.0 and 0.0 < inside < 1.0 else (inside, inside, inside):
                    total = 0.0
                    for c in range(n_channels):
                        there = curve_mean[curve, node, c]
                        there += place * (curve_mean[curve, node + 1, c] - there)
                        of_noise = curve_variance[curve, node, c]
                        of_noise += place * (curve_variance[curve, node + 1, c] - of_noise)
                        total += (point[c] - there) ** 2 * _weight(spread[c], of_noise, least)
                    if total < best:
                        best, segment[pair], share[pair] = total, node, place
        squared[pair] = best
        nearest = min(nearest, best)
