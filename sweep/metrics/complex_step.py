"""Derivatives by complex steps: functions of real arrays, or of complex ones whose tiny imaginary part is a derivative.

Nothing in such a function conjugates, compares or takes a modulus except of real parts.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.types import Array, Float

Smooth = NDArray[Any]
"""Real values, or values with a derivative as their imaginary part."""
COMPLEX_STEP = 1e-30
"""Step of the derivative: nothing is subtracted, so it may be so small that its square vanishes."""
_LN10 = math.log(10)


def moving(values: Float[Array, " ..."], slopes: Float[Array, " ..."]) -> Smooth:
    """Return values that move along their derivatives."""
    return values + 1j * COMPLEX_STEP * slopes


def root(square: Smooth) -> Smooth:
    """Return the square root, with value and slope 0 at 0, so that no NaN arises."""
    is_positive = square.real > 0
    return np.where(is_positive, np.where(is_positive, square, 1.0) ** 0.5, 0.0)


def ratio(over: Smooth, under: Smooth) -> Smooth:
    """Return the ratio of non-negative numbers; 0 / 0 is 0, NaN stays NaN."""
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        return np.where((over == 0) & (under == 0), 0.0, over / under)


def length(vectors: Smooth) -> Smooth:
    """Return the L2 norm over the last axis, of real vectors without squares; NaN where a component is NaN."""
    if np.iscomplexobj(vectors):
        return root((vectors**2).sum(axis=-1))
    norm, unknown = np.abs(vectors[..., 0]), np.isnan(vectors[..., 0])
    for at in range(1, vectors.shape[-1]):  # few, and a reduction over few is slow
        norm = np.hypot(norm, vectors[..., at])
        unknown |= np.isnan(vectors[..., at])
    return np.where(unknown, np.nan, norm)


def tail_decades(z: Smooth) -> Smooth:
    """Return -log10 of the probability Q(z) that a Gaussian is more than z standard deviations above its mean."""
    from scipy.special import log_ndtr  # noqa: PLC0415  (slow to import: kept off the start-up path)

    tail = log_ndtr(-z.real)
    if not np.iscomplexobj(z):
        return np.asarray(-tail / _LN10)
    by_z = np.exp(-(z.real**2) / 2 - tail) / (math.sqrt(2 * math.pi) * _LN10)
    return np.asarray(-tail / _LN10 + 1j * by_z * z.imag)
