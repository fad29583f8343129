"""Compiled inner loop of brightness curves: the point of a curve that is nearest to a reading.

It releases the GIL.
"""

from __future__ import annotations

import numpy as np

from ..base.machine_code import njit
from ..base.types import FloatArray, IndexArray
from .margin_kernels import balance, margin_at

_STEPS = 2
_BLOCK = 8
"""Segments that are skipped together where none of them can be near."""


@njit(cache=True, nogil=True)
def _weight(first: float, second: float, least: float, w: float) -> float:
    """Return the weight of a channel in 4 r^2 at a balance (see `discrimination`); 1 without noise."""
    if least <= 0.0:
        return 1.0
    return 4.0 * w / ((1.0 + w) * (max(first, least) + w * max(second, least)))


@njit(cache=True, nogil=True)
def nearest_on_curves(  # noqa: PLR0912, PLR0915  (one pass over pairs, blocks, segments and channels)
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

    Between two nodes mean and variance are straight. With `least` above 0 distances are d', of variances of at least so
    much; else in DN. Pairs that are farther than `margin` times the nearest squared
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
    difference, first_spread, second_spread = np.empty((3, n_channels))
    for pair in range(first.size):
        point, spread, curve = mean[first[pair]], variance[first[pair]], second[pair]
        best = np.inf
        for c in range(n_channels):
            first_spread[c] = max(spread[c], least)
        for block in range(n_blocks):
            bound = 0.0
            for c in range(n_channels):
                outside = max(low[curve, block, c] - point[c], point[c] - high[curve, block, c], 0.0)
                bound += outside * outside * _weight(spread[c], noise[curve, block, c], least, 1.0)
            if bound >= min(best, margin * nearest):
                continue
            for node in range(block * _BLOCK, min(block * _BLOCK + _BLOCK, n_nodes - 1)):
                inside, w = 0.5, 1.0
                # First with l = 1/2, which is no farther than the best l: then where that is near enough.
                for balanced in range(2 if least > 0.0 else 1):
                    along = length = 0.0
                    for c in range(n_channels):
                        step = curve_mean[curve, node + 1, c] - curve_mean[curve, node, c]
                        grows = curve_variance[curve, node + 1, c] - curve_variance[curve, node, c]
                        weight = _weight(spread[c], curve_variance[curve, node, c] + inside * grows, least, w)
                        along += (point[c] - curve_mean[curve, node, c]) * step * weight
                        length += step * step * weight
                    if not balanced:
                        inside = min(max(along / length, 0.0), 1.0) if length > 0.0 else 0.0
                    for _ in range(_STEPS if least > 0.0 and length > 0.0 else 0):  # the noise changes along it
                        slope = bend = 0.0
                        for c in range(n_channels):
                            step = curve_mean[curve, node + 1, c] - curve_mean[curve, node, c]
                            away = point[c] - curve_mean[curve, node, c] - inside * step
                            grows = curve_variance[curve, node + 1, c] - curve_variance[curve, node, c]
                            weight = _weight(spread[c], curve_variance[curve, node, c] + inside * grows, least, w)
                            slope -= 2.0 * away * step * weight + 0.25 * (1 + w) * away * away * grows * weight**2
                            bend += 2.0 * step * step * weight
                        inside = min(max(inside - slope / bend, 0.0), 1.0) if bend > 0.0 else inside
                    for place in (inside, 0.0, 1.0) if least > 0.0 and 0.0 < inside < 1.0 else (inside, inside, inside):
                        total = 0.0
                        for c in range(n_channels):
                            there = curve_mean[curve, node, c]
                            there += place * (curve_mean[curve, node + 1, c] - there)
                            of_noise = curve_variance[curve, node, c]
                            of_noise += place * (curve_variance[curve, node + 1, c] - of_noise)
                            difference[c], second_spread[c] = point[c] - there, max(of_noise, least)
                            total += difference[c] ** 2 * _weight(spread[c], of_noise, least, w)
                        if total >= min(best, margin * nearest):
                            continue
                        if least > 0.0:
                            w_here = balance(difference, first_spread, second_spread)
                            total = 4.0 * margin_at(w_here, difference, first_spread, second_spread) ** 2
                            w = w_here if place == inside else w
                        if total < best:
                            best, segment[pair], share[pair] = total, node, place
                    if w == 1.0:
                        break
        squared[pair] = best
        nearest = min(nearest, best)
