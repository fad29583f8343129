"""Compiled inner loops of biquadratic patches, known by their values at nine nodes (`phase.NODES`).

A patch lies within the convex hull of its Bernstein-Bezier control points (G. Farin, Curves and Surfaces for CAGD,
chapter 6), and so does each part of it within those of the part.
"""

from __future__ import annotations

import numpy as np

from ..base.machine_code import njit
from ..base.types import FloatArray

PARTS = 4
"""Parts of a patch along either axis, where it is divided."""
N_CONTROL = 2 * PARTS + 1
"""Control points of all parts along either axis: each shares those at its ends with the next."""


def _shares() -> FloatArray:
    """Of the values at -1, 0 and 1, in the control points of all parts: the polar form at two knots one after the
    other, and at one twice.
    """
    knots = np.repeat(np.linspace(-1, 1, PARTS + 1), 2)
    s, t = knots[:-1], knots[1:]
    mean, product = (s + t) / 2, s * t
    return np.stack([(product - mean) / 2, 1 - product, (product + mean) / 2], axis=1)


_SHARES = _shares()


@njit(cache=True, nogil=True)
def to_control(values: FloatArray, control: FloatArray) -> None:
    """Put the control points of a whole patch into `control`; ndarray[9] both, column by column."""
    for at in range(9):
        control[at] = values[at]
    for row in range(3):
        at = 3 * row + 1
        control[at] = 2 * values[at] - (values[at - 1] + values[at + 1]) / 2
    for column in range(3):
        control[column + 3] = 2 * control[column + 3] - (control[column] + control[column + 6]) / 2


@njit(cache=True, nogil=True, fastmath={"nnan", "nsz"})
def largest_derivatives(control: FloatArray, h: float) -> tuple[float, float]:
    """The largest first and second derivative along either axis of a patch of half width `h`."""
    first = second = 0.0
    for line in range(3):
        for step, start in ((1, 3 * line), (3, line)):
            a, b, c = control[start], control[start + step], control[start + 2 * step]
            first = max(first, abs(b - a), abs(c - b))
            second = max(second, abs(c - 2 * b + a))
    return first / h, second / (2 * h**2)


@njit(cache=True, nogil=True)
def to_parts(values: FloatArray, half_way: FloatArray, control: FloatArray) -> None:
    """Put the control points of all parts of a patch into `control`, ndarray[N_CONTROL, N_CONTROL].

    `half_way`: ndarray[3, N_CONTROL], to work in.
    """
    for row in range(3):
        for at in range(N_CONTROL):
            total = 0.0
            for column in range(3):
                total += _SHARES[at, column] * values[3 * row + column]
            half_way[row, at] = total
    for at in range(N_CONTROL):
        for column in range(N_CONTROL):
            total = 0.0
            for row in range(3):
                total += _SHARES[at, row] * half_way[row, column]
            control[at, column] = total
