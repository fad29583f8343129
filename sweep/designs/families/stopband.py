"""Stopbands: a channel leaves its base curve for a target curve and comes back, once or several times."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from ...base.types import FloatArray, Section
from ..bands import Banded


class MultiStopband(Banded):
    """N = base + sum over bands of depth (target - base) (e(l; left) - e(l; right)).

    `base`, `target`: QE, ndarray[n_wavelengths]. With the edges
    in order, the bands lie between 0 and 1 and do not overlap, so N lies between its base and its target at every
    wavelength, and is exactly the base outside the bands.
    """

    kind = "multi_stopband"
    n_modified = 1
    needs_target = True

    class Options(Section):
        """How many bands."""

        bands: int = Field(ge=1, le=8)

    def __init__(self, wavelength_nm: FloatArray, base: FloatArray, target: FloatArray, bands: int) -> None:
        super().__init__(wavelength_nm, bands)
        self._base = base
        self._change = target - base

    @classmethod
    def of_study(
        cls, wavelength_nm: FloatArray, base: FloatArray, target: FloatArray | None, options: Section
    ) -> MultiStopband:
        """See `Family.of_study`."""
        assert target is not None
        assert isinstance(options, MultiStopband.Options)
        return MultiStopband(wavelength_nm, base, target, options.bands)

    def curves(self, x: FloatArray) -> FloatArray:
        """QE of the modified channel, ndarray[n_designs, 1, n_wavelengths]; see `Family.curves`."""
        return (self._base + self._change * self._bands.shape(x))[:, None, :]

    def upper(self, low: FloatArray, high: FloatArray) -> FloatArray:
        """The base, or the target where it is higher and a band can reach; see `Family.upper`."""
        return (self._base + np.maximum(self._change, 0.0) * self._bands.reach(low, high))[None, :]

    def lower(self, low: FloatArray, high: FloatArray) -> FloatArray:
        """The base, or the target where it is lower and a band can reach; see `Family.lower`."""
        return (self._base + np.minimum(self._change, 0.0) * self._bands.reach(low, high))[None, :]

    def hull(self, low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Base and change where the bands are least and most open; see `Family.hull`."""
        ends = np.stack([self._base + self._change * shape for shape in self._bands.range(low, high)])
        return ends.min(axis=0)[None, :], ends.max(axis=0)[None, :]

    def gradient(self, x: FloatArray) -> FloatArray:
        """Derivative by each parameter, ndarray[n_parameters, 1, n_wavelengths]; see `Family.gradient`."""
        return (self._change * self._bands.gradient(x))[:, None, :]

    @property
    def moved(self) -> tuple[FloatArray, FloatArray]:
        """Base and change: bands move, the curves between which they go stay; see `MovedFamily`."""
        return self._base, self._change


class Stopband(MultiStopband):
    """One band: the paper's N_x with base Y and target G."""

    kind = "stopband"
    Options = Section  # type: ignore[assignment]  # it has none

    def __init__(self, wavelength_nm: FloatArray, base: FloatArray, target: FloatArray) -> None:
        super().__init__(wavelength_nm, base, target, 1)

    @classmethod
    def of_study(
        cls, wavelength_nm: FloatArray, base: FloatArray, target: FloatArray | None, options: Section
    ) -> Stopband:
        """See `Family.of_study`."""
        assert target is not None
        assert not options.model_fields_set
        return Stopband(wavelength_nm, base, target)

    @property
    def separable(self) -> tuple[FloatArray, FloatArray]:
        """See `SeparableFamily.separable`."""
        return self._base, self._change

    def edges(self, centers_and_widths: FloatArray) -> FloatArray:
        """See `SeparableFamily.edges`."""
        return self._bands.edges(centers_and_widths)
