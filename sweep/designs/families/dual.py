"""Two modified channels with the base curve as their mean: separation without loss of mean sensitivity."""

from __future__ import annotations

import numpy as np

from ...base.errors import SweepError, ValidationIssue
from ...base.types import (
    ChannelCurves,
    CurvesGradient,
    DesignCurves,
    DesignParameters,
    PerParameter,
    PerWavelength,
    Section,
)
from ..bands import Banded


class Dual(Banded):
    """Two channels with a constant sum; methods as in `Family`.

    N_a = base - swing, N_b = base + swing, with swing = depth (e(l; left) - e(l; right)) min(base, ceiling - base).
    With an open band and depth 1, the swing is the largest that keeps 0 <= N_a and N_b <= ceiling.

    Parameters
    ----------
    wavelength_nm : ndarray of shape (n_wavelengths,)
        Wavelengths, nm.
    base : ndarray of shape (n_wavelengths,)
        QE of the replaced curve.
    ceiling : ndarray of shape (n_wavelengths,)
        Upper bound on the QE, such as the clear pixel.
    """

    kind = "dual"
    n_modified = 2
    needs_target = True

    def __init__(self, wavelength_nm: PerWavelength, base: PerWavelength, ceiling: PerWavelength) -> None:
        super().__init__(wavelength_nm, 1)
        self._base = base
        self._room = np.minimum(base, np.maximum(ceiling - base, 0.0))

    @classmethod
    def of_study(
        cls, wavelength_nm: PerWavelength, base: PerWavelength, target: PerWavelength | None, options: Section
    ) -> Dual:
        """Make the family over curves of a study.

        Raises SweepError if the ceiling is nowhere above the base.
        """
        assert target is not None
        assert not options.model_fields_set
        if not (target > base).any():
            raise SweepError(ValidationIssue("dual: `to` must exceed `base` somewhere"))
        return Dual(wavelength_nm, base, target)

    def curves(self, x: DesignParameters) -> DesignCurves:
        """Return the QE of both channels."""
        swing = self._room * self._bands.shape(x)
        return np.stack([self._base - swing, self._base + swing], axis=1)

    def upper(self, low: PerParameter, high: PerParameter) -> ChannelCurves:
        """Return the base, and the base plus the whole swing where the band can reach."""
        return np.stack([self._base, self._base + self._room * self._bands.reach(low, high)])

    def lower(self, low: PerParameter, high: PerParameter) -> ChannelCurves:
        """Return the base minus the whole swing where the band can reach, and the base."""
        return np.stack([self._base - self._room * self._bands.reach(low, high), self._base])

    def hull(self, low: PerParameter, high: PerParameter) -> tuple[ChannelCurves, ChannelCurves]:
        """Return the base with the least and the most swing."""
        least, most = (self._room * shape for shape in self._bands.range(low, high))
        return np.stack([self._base - most, self._base + least]), np.stack([self._base - least, self._base + most])

    def gradient(self, x: PerParameter) -> CurvesGradient:
        """Return the derivative of `curves` at one design."""
        slope = self._room * self._bands.gradient(x)
        return np.stack([-slope, slope], axis=1)
