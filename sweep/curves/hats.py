"""Linear interpolation as a matrix."""

from __future__ import annotations

import numpy as np

from ..types import FloatArray


def hats(at: FloatArray, knots: FloatArray) -> FloatArray:
    """Weights of values at ascending `knots` in the lines between them, ndarray[n_knots, n_at]; flat beyond the ends.

    Any f, ndarray[..., n_knots], is f @ hats at the points `at`.
    """
    return np.stack([np.interp(at, knots, unit) for unit in np.eye(knots.size)])
