"""Compiled inner loops: values through edges and shapes of curves, without an array per step.

They release the GIL and are compiled once per machine (Numba's cache). Sums keep their order, so that results are those
of the same sums in NumPy.
"""

from __future__ import annotations

import numpy as np

from ..base.machine_code import njit
from ..base.types import FloatArray, IndexArray
from .vectorized import larger, smaller

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
    """base + depth (left - right) of each design, ndarray[n_designs, n]: `left`, `right`: ndarray[n_edges, n].

    `at_left`, `at_right`, `depth`: ndarray[n_designs].
    """
    for d in range(depth.size):
        one, other, deep = at_left[d], at_right[d], depth[d]
        for s in range(base.size):
            out[d, s] = base[s] + deep * (left[one, s] - right[other, s])


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
    """Largest step between neighboring wavelengths, and smallest ratio to a base curve.

    `curves`: ndarray[n_designs, n_wavelengths]; `inverse`, `dark`: ndarray[n_wavelengths], 1 / base and 0, or 0 and 1
    where the base is 0. `steepest`, `lowest`: ndarray[n_designs].
    """
    for d in range(curves.shape[0]):
        steepest[d], lowest[d] = _shape(curves[d], inverse, dark)


@njit(cache=True, nogil=True)
def spans(edges: FloatArray) -> IndexArray:
    """Where each edge rises: its first value that is not 0, and one after the last that is not 1: [n_edges, 2]."""
    found = np.empty((edges.shape[0], 2), np.intp)
    for e in range(edges.shape[0]):
        begin, end = 0, edges.shape[1]
        while begin < end and edges[e, begin] == 0.0:
            begin += 1
        while end > 0 and edges[e, end - 1] == 1.0:
            end -= 1
        found[e, 0], found[e, 1] = begin, end
    return found


@njit(cache=True, nogil=True, fastmath=_NUMBERS)
def _outside(base: FloatArray, inverse: FloatArray, dark: FloatArray) -> tuple[FloatArray, FloatArray]:
    """`_shape` of the base curve's first w wavelengths, and of those from w on: two ndarray[n_wavelengths + 1, 2]."""
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
def _between_edges(
    base: FloatArray, change: FloatArray, deep: float, left: FloatArray, right: FloatArray, curve: FloatArray
) -> None:
    for w in range(curve.size):
        curve[w] = base[w] + change[w] * (deep * (left[w] - right[w]))


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
    inverse: FloatArray,
    dark: FloatArray,
    steepest: FloatArray,
    lowest: FloatArray,
) -> None:
    """`shapes` of base + change depth (left - right), without keeping a curve.

    `base`, `change`: ndarray[n_wavelengths]; `left`, `right`: ndarray[n_edges, n_wavelengths]; their `spans`; the rest
    as in `through_edges`. Where both edges are 0, or both 1, the curve is its base, and is not looked at again.
    """
    before, after = _outside(base, inverse, dark)
    curve = np.empty(base.size)
    for d in range(depth.size):
        one, other = at_left[d], at_right[d]
        begin = min(left_spans[one, 0], right_spans[other, 0])
        end = max(left_spans[one, 1], right_spans[other, 1])
        own = slice(max(begin - 1, 0), min(end + 1, base.size))  # with the steps to both sides
        _between_edges(base[own], change[own], depth[d], left[one, own], right[other, own], curve[own])
        step, low = _shape(curve[own], inverse[own], dark[own])
        steepest[d] = larger(step, larger(before[begin, 0], after[end, 0]))
        lowest[d] = smaller(low, smaller(before[begin, 1], after[end, 1]))
