"""Compiled inner loops: values through edges and shapes of curves, without an array per step.

They release the GIL and are compiled once per machine (Numba's cache). Sums keep their order, so that results are those
of the same sums in NumPy.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from ..types import FloatArray, IndexArray

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
        low = min(low, curve[w] * inverse[w] + dark[w])
    for w in range(curve.size - 1):
        step = max(step, abs(curve[w + 1] - curve[w]))
    return step, low


@njit(cache=True, nogil=True, fastmath=_NUMBERS)
def shapes(curves: FloatArray, inverse: FloatArray, dark: FloatArray, steepest: FloatArray, lowest: FloatArray) -> None:
    """Largest step between neighboring wavelengths, and smallest ratio to a base curve.

    `curves`: ndarray[n_designs, n_wavelengths]; `inverse`, `dark`: ndarray[n_wavelengths], 1 / base and 0, or 0 and 1
    where the base is 0. `steepest`, `lowest`: ndarray[n_designs].
    """
    for d in range(curves.shape[0]):
        steepest[d], lowest[d] = _shape(curves[d], inverse, dark)


@njit(cache=True, nogil=True, fastmath=_NUMBERS)
def shapes_of_edges(
    base: FloatArray,
    change: FloatArray,
    left: FloatArray,
    right: FloatArray,
    at_left: IndexArray,
    at_right: IndexArray,
    depth: FloatArray,
    inverse: FloatArray,
    dark: FloatArray,
    steepest: FloatArray,
    lowest: FloatArray,
) -> None:
    """`shapes` of base + change depth (left - right), without keeping a curve.

    `base`, `change`: ndarray[n_wavelengths]; `left`, `right`: ndarray[n_edges, n_wavelengths]; the rest as in
    `through_edges`.
    """
    curve = np.empty(base.size)
    for d in range(depth.size):
        one, other, deep = at_left[d], at_right[d], depth[d]
        for w in range(base.size):
            curve[w] = base[w] + change[w] * (deep * (left[one, w] - right[other, w]))
        steepest[d], lowest[d] = _shape(curve, inverse, dark)
