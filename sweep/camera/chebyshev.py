"""Chebyshev's polynomials: functions without fine detail, known from their values at a few nodes.

The polynomial through values at n nodes is at most `growth(n)` times as large as the largest of these (Lebesgue's
constant of these nodes: T. J. Rivlin, The Chebyshev Polynomials, 1974, section 1.3).
"""

from __future__ import annotations

import math

import numpy as np

from ..base.types import FloatArray

_TOGETHER = 16
"""Polynomials whose angles are sums of the same one and small ones."""


def roots(order: int) -> FloatArray:
    """Nodes of some order, where the polynomial of that order is nothing, between -1 and 1, the highest first."""
    return np.asarray(np.cos(_angles(order)))


def _angles(order: int) -> FloatArray:
    return np.asarray(math.pi * (np.arange(order) + 0.5) / order)


def to_orders(order: int) -> FloatArray:
    """From values at the nodes to the shares of the polynomials, ndarray[order, order]."""
    found = np.cos(np.outer(np.arange(order), _angles(order))) * (2 / order)
    found[0] /= 2
    return np.asarray(found)


def polynomials(angles: FloatArray, order: int) -> FloatArray:
    """Their values at the cosines of some angles, ndarray[n, order].

    Cosines of sums of angles are products, so that few are looked up.
    """
    fine, coarse = np.arange(_TOGETHER), _TOGETHER * np.arange(-(-order // _TOGETHER))
    few, many = np.outer(angles, fine)[:, None], np.outer(angles, coarse)[:, :, None]
    found = np.cos(many) * np.cos(few)
    found -= np.sin(many) * np.sin(few)
    return np.asarray(found.reshape(len(angles), -1)[:, :order])


def growth(order: int) -> float:
    """How many times its largest value at the nodes a polynomial may be between them."""
    return 1 + 2 / math.pi * math.log(order)
