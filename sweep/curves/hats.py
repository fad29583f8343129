"""Linear interpolation as a matrix."""

from __future__ import annotations

import numpy as np

from ..base.types import FloatArray


def hats(at: FloatArray, knots: FloatArray) -> FloatArray:
    """Weights of values at ascending `knots` in the lines between them, ndarray[n_knots, n_at]; flat beyond the ends.

    Any f, ndarray[..., n_knots], is f @ hats at the points `at`.
    """
    if knots.size == 1:
        return np.ones((1, at.size))
    left = np.clip(np.searchsorted(knots, at, side="right") - 1, 0, knots.size - 2)
    share = np.clip(1 / np.diff(knots)[left] * (at - knots[left]), 0.0, 1.0)
    share[at >= knots[-1]] = 1.0
    found, points = np.zeros((knots.size, at.size)), np.arange(at.size)
    found[left, points], found[left + 1, points] = 1 - share, share
    return found
