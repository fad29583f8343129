"""Two modified channels whose mean stays the base curve: separation without any loss of mean sensitivity."""

from __future__ import annotations

import numpy as np

from ..arrays import FloatArray
from .base import Parameter
from .stopband import Bands


class Dual:
    """N_a = base - swing, N_b = base + swing, so N_a + N_b = 2 base exactly.

    swing = depth (e(l; left) - e(l; right)) min(base, ceiling - base): where the band is open and `depth` is 1, the
    swing is the largest that keeps 0 <= N_a and N_b <= ceiling. `base`, `ceiling`: QE, ndarray[n_wavelengths], ceiling
    >= base (such as the clear pixel).
    """

    kind = "dual"
    n_modified = 2
    start_dimensions: int | None = None

    def __init__(self, wavelength_nm: FloatArray, base: FloatArray, ceiling: FloatArray) -> None:
        self._bands = Bands(wavelength_nm, 1)
        self._base = base
        self._room = np.minimum(base, np.maximum(ceiling - base, 0.0))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Edges, widths and depth of the swing."""
        return self._bands.parameters

    def curves(self, x: FloatArray) -> FloatArray:
        """QE of both channels, ndarray[n_designs, 2, n_wavelengths]; see `Family.curves`."""
        swing = self._room * self._bands.shape(x)
        return np.stack([self._base - swing, self._base + swing], axis=1)

    def gradient(self, x: FloatArray) -> FloatArray:
        """Derivative by each parameter, ndarray[5, 2, n_wavelengths]; see `Family.gradient`."""
        slope = self._room * self._bands.gradient(x)
        return np.stack([-slope, slope], axis=1)

    def start(self, points: FloatArray) -> FloatArray:
        """Not needed: a search starts anywhere in its box."""
        return points

    def violation(self, x: FloatArray) -> FloatArray:
        """Edges out of order, nm; see `Bands.violation`."""
        return self._bands.violation(x)

    def violation_gradient(self, x: FloatArray) -> FloatArray:
        """See `Bands.violation_gradient`."""
        return self._bands.violation_gradient(x)
