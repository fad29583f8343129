"""Two modified channels whose mean stays the base curve: separation without any loss of mean sensitivity."""

from __future__ import annotations

import numpy as np

from ...base.errors import Fault, SweepError
from ...base.types import FloatArray, Section
from ..bands import Banded


class Dual(Banded):
    """N_a = base - swing, N_b = base + swing, so N_a + N_b = 2 base exactly.

    swing = depth (e(l; left) - e(l; right)) min(base, ceiling - base): where the band is open and `depth` is 1, the
    swing is the largest that keeps 0 <= N_a and N_b <= ceiling. `base`, `ceiling`: QE, ndarray[n_wavelengths], ceiling
    >= base (such as the clear pixel).
    """

    kind = "dual"
    n_modified = 2
    needs_target = True
    Options = Section

    def __init__(self, wavelength_nm: FloatArray, base: FloatArray, ceiling: FloatArray) -> None:
        super().__init__(wavelength_nm, 1)
        self._base = base
        self._room = np.minimum(base, np.maximum(ceiling - base, 0.0))

    @classmethod
    def of_study(cls, wavelength_nm: FloatArray, base: FloatArray, target: FloatArray | None, options: Section) -> Dual:
        """See `Family.of_study`; raises SweepError for a ceiling that is nowhere above the base."""
        assert target is not None
        assert not options.model_fields_set
        if not (target > base).any():
            raise SweepError(Fault("dual needs a ceiling `to` above its base: there is no room to swing"))
        return Dual(wavelength_nm, base, target)

    def curves(self, x: FloatArray) -> FloatArray:
        """QE of both channels, ndarray[n_designs, 2, n_wavelengths]; see `Family.curves`."""
        swing = self._room * self._bands.shape(x)
        return np.stack([self._base - swing, self._base + swing], axis=1)

    def upper(self, low: FloatArray, high: FloatArray) -> FloatArray:
        """The base, and the base with the whole swing where the band can reach; see `Family.upper`."""
        return np.stack([self._base, self._base + self._room * self._bands.reach(low, high)])

    def lower(self, low: FloatArray, high: FloatArray) -> FloatArray:
        """The base without the whole swing where the band can reach, and the base; see `Family.lower`."""
        return np.stack([self._base - self._room * self._bands.reach(low, high), self._base])

    def hull(self, low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The base with the least and the most swing; see `Family.hull`."""
        least, most = (self._room * shape for shape in self._bands.range(low, high))
        return np.stack([self._base - most, self._base + least]), np.stack([self._base - least, self._base + most])

    def gradient(self, x: FloatArray) -> FloatArray:
        """Derivative by each parameter, ndarray[5, 2, n_wavelengths]; see `Family.gradient`."""
        slope = self._room * self._bands.gradient(x)
        return np.stack([-slope, slope], axis=1)
