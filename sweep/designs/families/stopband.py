"""Stopbands: a channel leaves its base curve for a target curve and comes back, once or several times."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from ...base.types import (
    Array,
    ChannelCurves,
    CurvesGradient,
    DesignCurves,
    DesignParameters,
    Float,
    PerParameter,
    PerWavelength,
    Section,
)
from ..bands import Banded


class MultiStopband(Banded):
    """Filter with several stopbands; methods as in `Family`.

    Notes
    -----
    N = base + sum over bands of depth (target - base) (e(l; left) - e(l; right)). With edges in order, bands do not
    overlap, so that N lies between base and target at every wavelength, and equals the base outside the bands.

    Parameters
    ----------
    wavelength_nm : ndarray of shape (n_wavelengths,)
        Wavelengths, nm.
    base, target : ndarray of shape (n_wavelengths,)
        QE of the replaced curve, and inside the bands.
    bands : int
        Number of bands.
    """

    kind = "multi_stopband"
    n_modified = 1
    needs_target = True

    class Options(Section):
        """Options: number of bands."""

        bands: int = Field(ge=1, le=8)
        """Number of bands."""

    def __init__(self, wavelength_nm: PerWavelength, base: PerWavelength, target: PerWavelength, bands: int) -> None:
        super().__init__(wavelength_nm, bands)
        self._base = base
        self._change = target - base

    @classmethod
    def of_study(
        cls, wavelength_nm: PerWavelength, base: PerWavelength, target: PerWavelength | None, options: Section
    ) -> MultiStopband:
        """Make the family over curves of a study."""
        assert target is not None
        assert isinstance(options, MultiStopband.Options)
        return MultiStopband(wavelength_nm, base, target, options.bands)

    def curves(self, x: DesignParameters) -> DesignCurves:
        """Return the QE of the modified channel."""
        curves = self._bands.shape(x)
        curves *= self._change
        curves += self._base
        return curves[:, None, :]

    def upper(self, low: PerParameter, high: PerParameter) -> ChannelCurves:
        """Return the base, or the target where it is higher and a band can reach."""
        return (self._base + np.maximum(self._change, 0.0) * self._bands.reach(low, high))[None, :]

    def lower(self, low: PerParameter, high: PerParameter) -> ChannelCurves:
        """Return the base, or the target where it is lower and a band can reach."""
        return (self._base + np.minimum(self._change, 0.0) * self._bands.reach(low, high))[None, :]

    def hull(self, low: PerParameter, high: PerParameter) -> tuple[ChannelCurves, ChannelCurves]:
        """Return base and change with the bands least and most open."""
        ends = np.stack([self._base + self._change * shape for shape in self._bands.range(low, high)])
        return ends.min(axis=0)[None, :], ends.max(axis=0)[None, :]

    def gradient(self, x: PerParameter) -> CurvesGradient:
        """Return the derivative of `curves` at one design."""
        return (self._change * self._bands.gradient(x))[:, None, :]

    @property
    def moved(self) -> tuple[PerWavelength, PerWavelength]:
        """Base and change: bands move, the curves stay; see `MovedFamily`."""
        return self._base, self._change


class Stopband(MultiStopband):
    """Filter with one stopband: the paper's N_x with base Y and target G.

    Its parameters, the columns of `x`: left_nm, left_width_nm, right_nm, right_width_nm and depth, by default 1.
    `LoadedStudy.evaluate` takes them by name.

    Parameters
    ----------
    wavelength_nm : ndarray of shape (n_wavelengths,)
        Wavelengths, nm.
    base, target : ndarray of shape (n_wavelengths,)
        QE of the replaced curve, and inside the band.
    """

    kind = "stopband"
    Options = Section  # type: ignore[assignment]  # it has none

    def __init__(self, wavelength_nm: PerWavelength, base: PerWavelength, target: PerWavelength) -> None:
        super().__init__(wavelength_nm, base, target, 1)

    @classmethod
    def of_study(
        cls, wavelength_nm: PerWavelength, base: PerWavelength, target: PerWavelength | None, options: Section
    ) -> Stopband:
        """Make the family over curves of a study."""
        assert target is not None
        assert not options.model_fields_set
        return Stopband(wavelength_nm, base, target)

    @property
    def separable(self) -> tuple[PerWavelength, PerWavelength]:
        """See `SeparableFamily.separable`."""
        return self._base, self._change

    def edges(self, centers_and_widths: Float[Array, "bands 2"]) -> Float[Array, "bands wavelengths"]:
        """Return rising edges; see `SeparableFamily.edges`."""
        return self._bands.edges(centers_and_widths)
