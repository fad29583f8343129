"""One stopband: the channel leaves its base curve for a target curve and comes back."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from ..arrays import FloatArray
from ..edges import SPAN_PER_WIDTH, edge, edge_gradient
from .base import Parameter

_HALF = SPAN_PER_WIDTH / 2


class Stopband:
    """N = base + depth (target - base) (e(l; left) - e(l; right)), the paper's N_x with base Y and target G.

    `base`, `target`: QE, ndarray[n_wavelengths]. With the edges in order, the band lies between 0 and 1, so N lies
    between its base and its target at every wavelength, and is exactly the base outside the band.
    """

    kind: ClassVar[str] = "stopband"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("left_nm", 200, 2000),
        Parameter("left_width_nm", 0, 500),
        Parameter("right_nm", 200, 2000),
        Parameter("right_width_nm", 0, 500),
        Parameter("depth", 0, 1, default=1.0),
    )

    def __init__(self, wavelength_nm: FloatArray, base: FloatArray, target: FloatArray) -> None:
        self._wave = wavelength_nm
        self._base = base
        self._change = target - base

    def band(self, x: FloatArray) -> FloatArray:
        """The band without its depth: ndarray[n_designs, n_parameters] -> ndarray[n_designs, n_wavelengths]."""
        left, left_width, right, right_width, _ = (x[:, i, None] for i in range(5))
        return edge(self._wave, left, left_width) - edge(self._wave, right, right_width)

    def curves(self, x: FloatArray) -> FloatArray:
        """QE of the modified channel, ndarray[n_designs, 1, n_wavelengths]; see `Family.curves`."""
        return (self._base + x[:, 4, None] * self._change * self.band(x))[:, None, :]

    def gradient(self, x: FloatArray) -> FloatArray:
        """Derivative by each parameter, ndarray[5, 1, n_wavelengths]; see `Family.gradient`."""
        left, left_width, right, right_width, depth = x
        by_left = edge_gradient(self._wave, left, left_width)
        by_right = edge_gradient(self._wave, right, right_width)
        scaled = depth * self._change
        rows = [
            *(scaled * d for d in by_left),
            *(-scaled * d for d in by_right),
            self._change * self.band(x[None])[0],
        ]
        return np.stack(rows)[:, None, :]

    def violation(self, x: FloatArray) -> FloatArray:
        """Start and end of the left edge must not lie behind those of the right edge: nm, ndarray[n_designs, 2]."""
        left, left_width, right, right_width = (x[:, i] for i in range(4))
        apart, half = left - right, _HALF * (left_width - right_width)
        return np.stack([apart - half, apart + half], axis=1)

    def violation_gradient(self, x: FloatArray) -> FloatArray:
        """Constant, ndarray[2, 5]."""
        assert x.shape == (5,)
        return np.array([[1, -_HALF, -1, _HALF, 0], [1, _HALF, -1, -_HALF, 0]], dtype=float)
