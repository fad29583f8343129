"""Compiled inner loops: values through edges, and shapes of curves, without an array per step.

They release the GIL. Sums keep their order, so results equal those of the same sums in NumPy.
"""

from __future__ import annotations

import numpy as np

from ..base.lane_kernels import larger, smaller
from ..base.machine_code import njit
from ..base.types import FloatArray, IndexArray

_NUMBERS = {"nnan", "nsz"}
"""Lets the compiler take the smaller of several numbers at once; callers hand in no NaN."""


@njit(cache=True, nogil=True)
def through_edges(
    base: FloatArray,
    left: FloatArray,
    right: FloatArray,
    at_left: IndexArray,
    at_right: IndexArray,
    depth: FloatArray,
    out: FloatArray,
) -> None:
    """Compute base + depth (left - right) of each design."""
    for d in range(depth.size):
        left_edge, right_edge, deep = at_left[d], at_right[d], depth[d]
        for s in range(base.size):
            out[d, s] = base[s] + deep * (left[left_edge, s] - right[right_edge, s])


@njit(cache=True, nogil=True, fastmath=_NUMBERS)
def between_edges(
    wavelength_nm: FloatArray, centers_nm: FloatArray, per_nm: FloatArray, depths: FloatArray, out: FloatArray
) -> None:
    """Add the bands of each design, depth times left less right edge (see `edge.edge`), for two edges a band.

    `per_nm`: 1 / span of each edge; 0: a step.
    """
    for d in range(depths.shape[0]):
        row = out[d]
        for band in range(depths.shape[1]):
            left_nm, right_nm = centers_nm[d, 2 * band], centers_nm[d, 2 * band + 1]
            left_per, right_per, depth = per_nm[d, 2 * band], per_nm[d, 2 * band + 1], depths[d, band]
            if left_per > 0.0 and right_per > 0.0:
                for w in range(row.size):
                    t = smaller(larger((wavelength_nm[w] - left_nm) * left_per + 0.5, 0.0), 1.0)
                    u = smaller(larger((wavelength_nm[w] - right_nm) * right_per + 0.5, 0.0), 1.0)
                    rise, fall = t * t * t * (t * (6 * t - 15) + 10), u * u * u * (u * (6 * u - 15) + 10)
                    row[w] += depth * (rise - fall)
            else:
                for w in range(row.size):
                    row[w] += depth * (
                        _edge(wavelength_nm[w] - left_nm, left_per) - _edge(wavelength_nm[w] - right_nm, right_per)
                    )


@njit(cache=True, nogil=True)
def _edge(offset_nm: float, per_nm: float) -> float:
    t = np.sign(offset_nm) / 2 if per_nm == 0.0 else offset_nm * per_nm
    t = min(max(t + 0.5, 0.0), 1.0)
    return float(t * t * t * (t * (6 * t - 15) + 10))


@njit(cache=True, nogil=True, fastmath=_NUMBERS)
def _shape(curve: FloatArray, inverse: FloatArray, dark: FloatArray) -> tuple[float, float]:
    step, low = 0.0, np.inf
    for w in range(curve.size):
        low = smaller(low, curve[w] * inverse[w] + dark[w])
    for w in range(curve.size - 1):
        step = larger(step, abs(curve[w + 1] - curve[w]))
    return step, low


@njit(cache=True, nogil=True, fastmath=_NUMBERS)
def shapes(curves: FloatArray, inverse: FloatArray, dark: FloatArray, steepest: FloatArray, lowest: FloatArray) -> None:
    """Compute the largest step between neighboring wavelengths, and the smallest ratio to a base curve.

    `inverse`, `dark`: 1 / base and 0, or 0 and 1 where the base is 0.
    """
    for d in range(curves.shape[0]):
        steepest[d], lowest[d] = _shape(curves[d], inverse, dark)


@njit(cache=True, nogil=True)
def spans(edges: FloatArray) -> IndexArray:
    """Return the range in which each edge rises: its first nonzero value, and one after its last value below 1."""
    ranges = np.empty((edges.shape[0], 2), np.intp)
    for e in range(edges.shape[0]):
        begin, end = 0, edges.shape[1]
        while begin < end and edges[e, begin] == 0.0:
            begin += 1
        while end > 0 and edges[e, end - 1] == 1.0:
            end -= 1
        ranges[e, 0], ranges[e, 1] = begin, end
    return ranges


@njit(cache=True, nogil=True, fastmath=_NUMBERS)
def outside(base: FloatArray, inverse: FloatArray, dark: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the shape of the base curve's first w wavelengths, and of those from w on."""
    n = base.size
    before, after = np.empty((n + 1, 2)), np.empty((n + 1, 2))
    before[0, 0] = after[n, 0] = 0.0
    before[0, 1] = after[n, 1] = np.inf
    for w in range(n):
        rise = abs(base[w] - base[w - 1]) if w > 0 else 0.0
        before[w + 1, 0] = larger(before[w, 0], rise)
        before[w + 1, 1] = smaller(before[w, 1], base[w] * inverse[w] + dark[w])
    for w in range(n - 1, -1, -1):
        rise = abs(base[w + 1] - base[w]) if w + 1 < n else 0.0
        after[w, 0] = larger(after[w + 1, 0], rise)
        after[w, 1] = smaller(after[w + 1, 1], base[w] * inverse[w] + dark[w])
    return before, after


@njit(cache=True, nogil=True, fastmath=_NUMBERS)
def ranges_of(curve: FloatArray, inverse: FloatArray, dark: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return steepest step and lowest ratio of 2^k wavelengths from each on."""
    n = curve.size
    levels = 1
    while 1 << levels <= n:
        levels += 1
    steps, lows = np.zeros((levels, n)), np.empty((levels, n))
    for w in range(n):
        lows[0, w] = curve[w] * inverse[w] + dark[w]
    for w in range(n - 1):
        steps[0, w] = abs(curve[w + 1] - curve[w])
    for k in range(1, levels):
        half = 1 << (k - 1)
        for w in range(n - 2 * half + 1):
            steps[k, w] = larger(steps[k - 1, w], steps[k - 1, w + half])
            lows[k, w] = smaller(lows[k - 1, w], lows[k - 1, w + half])
    return steps, lows


@njit(cache=True, nogil=True, fastmath=_NUMBERS)
def edge_shapes(
    base: FloatArray, change: FloatArray, edges: FloatArray, spans: IndexArray, inverse: FloatArray, dark: FloatArray
) -> FloatArray:
    """Return the shape where each edge rises or falls alone, with the steps to both sides."""
    shapes, curve = np.empty((edges.shape[0], 2)), np.empty(base.size)
    for e in range(edges.shape[0]):
        near_edge = slice(max(spans[e, 0] - 1, 0), min(spans[e, 1] + 1, base.size))
        for w in range(near_edge.start, near_edge.stop):
            curve[w] = base[w] + change[w] * edges[e, w]
        shapes[e] = _shape(curve[near_edge], inverse[near_edge], dark[near_edge])
    return shapes


@njit(cache=True, nogil=True, fastmath=_NUMBERS)
def _between_edges(
    base: FloatArray, change: FloatArray, deep: float, left: FloatArray, right: FloatArray, curve: FloatArray
) -> None:
    for w in range(curve.size):
        curve[w] = base[w] + change[w] * (deep * (left[w] - right[w]))


@njit(cache=True, nogil=True, fastmath=_NUMBERS)
def _inner_shape(steps: FloatArray, lows: FloatArray, begin: int, end: int) -> tuple[float, float]:
    """Return the shape of wavelengths begin..end-1, at least one, from `ranges_of`."""
    n, k, step = end - begin, 0, 0.0
    while 1 << (k + 1) <= n:
        k += 1
    low = smaller(lows[k, begin], lows[k, end - (1 << k)])
    if n > 1:  # one step less than values
        k -= 1 << k > n - 1
        step = larger(steps[k, begin], steps[k, end - 1 - (1 << k)])
    return step, low


@njit(cache=True, nogil=True, fastmath=_NUMBERS)
def shapes_of_edges(
    base: FloatArray,
    change: FloatArray,
    left: FloatArray,
    right: FloatArray,
    left_spans: IndexArray,
    right_spans: IndexArray,
    at_left: IndexArray,
    at_right: IndexArray,
    depth: FloatArray,
    deep: float,
    inverse: FloatArray,
    dark: FloatArray,
    before: FloatArray,
    after: FloatArray,
    steps: FloatArray,
    lows: FloatArray,
    of_left: FloatArray,
    of_right: FloatArray,
    steepest: FloatArray,
    lowest: FloatArray,
) -> None:
    """Compute `shapes` of base + change depth (left - right), without keeping a curve.

    Where both edges are 0, or both 1, the curve is its base: `before` and `after` of `outside`. Where one edge rises
    before the other, the curve between them follows from `steps` and `lows` of `ranges_of`; where one edge rises, from
    the `edge_shapes` `of_left` and `of_right`, for designs of depth `deep`.
    """
    curve, n = np.empty(base.size), base.size
    for d in range(depth.size):
        left_edge, right_edge = at_left[d], at_right[d]
        risen, falls = left_spans[left_edge, 1], right_spans[right_edge, 0]
        if depth[d] == deep and 0 < left_spans[left_edge, 0] < risen < falls < right_spans[right_edge, 1] < n:
            begin, end = left_spans[left_edge, 0], right_spans[right_edge, 1]
            step, low = _inner_shape(steps, lows, risen, falls)
            step = larger(larger(step, of_left[left_edge, 0]), of_right[right_edge, 0])
            low = smaller(smaller(low, of_left[left_edge, 1]), of_right[right_edge, 1])
        else:
            begin = min(left_spans[left_edge, 0], right_spans[right_edge, 0])
            end = max(left_spans[left_edge, 1], right_spans[right_edge, 1])
            between = slice(max(begin - 1, 0), min(end + 1, base.size))  # with the steps to both sides
            _between_edges(
                base[between],
                change[between],
                depth[d],
                left[left_edge, between],
                right[right_edge, between],
                curve[between],
            )
            step, low = _shape(curve[between], inverse[between], dark[between])
        steepest[d] = larger(step, larger(before[begin, 0], after[end, 0]))
        lowest[d] = smaller(low, smaller(before[begin, 1], after[end, 1]))
