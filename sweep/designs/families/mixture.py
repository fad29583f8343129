"""Filters of colorants: a channel is a base curve behind a mixture that absorbs (law of Beer and Lambert)."""

from __future__ import annotations

import math
from abc import abstractmethod
from copy import copy
from dataclasses import replace
from typing import Literal, Self

import numpy as np
from pydantic import Field

from ...base.types import (
    Array,
    ChannelCurves,
    CurvesGradient,
    DesignCurves,
    DesignParameters,
    Float,
    IndexArray,
    Int,
    PerParameter,
    PerWavelength,
    Section,
)
from ...spectra.colorants import GAUSSIAN
from ..family import Family, Parameter
from ..tolerance import ProductionError

GaussianIn = Literal["wavenumber", "wavelength"]

_LN10 = math.log(10)
_MOST_ABSORBANCE = 6.0
THICKNESS_UM = 0.8
"""Usual thickness of a color resist, which absorbances of colorants are stated for."""
_BASELINE = Parameter(
    "baseline_absorbance", 0, _MOST_ABSORBANCE, default=0.0, meaning="decadic absorbance at all wavelengths"
)
_BANDS: tuple[Parameter, ...] = (
    Parameter("peak_nm", 200, 2000, unit="nm", meaning="peak of the absorption band"),
    Parameter("fwhm_nm", 1, 500, unit="nm", meaning="full width of the band at half of its absorbance"),
    Parameter("absorbance", 0, _MOST_ABSORBANCE, meaning="decadic absorbance at the peak"),
)


class Absorbing(Family):
    """Filter that is the base times 10 to the minus absorbance."""

    def __init__(self, wavelength_nm: PerWavelength, base: PerWavelength) -> None:
        self._wavelength_nm, self._base = wavelength_nm, base
        # As production makes it: wavelengths, relative thickness of the film, and relative width of the bands.
        self._nominal_nm, self._film, self._width = wavelength_nm, 1.0, 1.0

    @abstractmethod
    def absorbance(self, x: DesignParameters) -> Float[Array, "designs wavelengths"]:
        """Return the absorbance.

        It is decadic.
        """

    @abstractmethod
    def absorbance_gradient(self, x: PerParameter) -> Float[Array, "parameters wavelengths"]:
        """Return the derivative of `absorbance` at one design.

        Returns absorbance per unit of parameter.
        """

    def curves(self, x: DesignParameters) -> DesignCurves:
        """Return the QE of the modified channel."""
        return np.asarray((self._base * np.power(10.0, -self._film * self.absorbance(x)))[:, None, :], dtype=float)

    def gradient(self, x: PerParameter) -> CurvesGradient:
        """Return the derivative of `curves` at one design."""
        slope = -_LN10 * self._film * self.curves(x[None])[0] * self.absorbance_gradient(x)
        return np.asarray(slope[:, None, :], dtype=float)

    def upper(self, low: PerParameter, high: PerParameter) -> ChannelCurves:
        """Return the base behind the least absorbance of a box."""
        return self.hull(low, high)[1]

    def lower(self, low: PerParameter, high: PerParameter) -> ChannelCurves:
        """Return the base behind the largest absorbance of a box."""
        return self.hull(low, high)[0]

    def hull(self, low: PerParameter, high: PerParameter) -> tuple[ChannelCurves, ChannelCurves]:
        """Return the base behind the largest and the least absorbance of a box."""
        least, most = (self._film * end for end in self.absorbance_range(low, high))
        return (self._base * np.power(10.0, -most))[None], (self._base * np.power(10.0, -least))[None]

    @abstractmethod
    def absorbance_range(self, low: PerParameter, high: PerParameter) -> tuple[PerWavelength, PerWavelength]:
        """Return bounds on the absorbance in a box."""

    def perturbed(self, production_error: ProductionError) -> Self:
        """Return the family with bands that are moved and broader, in films that are too thick, which moves nothing."""
        family = copy(self)
        family._nominal_nm, family._film = (
            self._wavelength_nm - production_error.shift_nm,
            1 + production_error.thickness,
        )
        family._width = 1 + production_error.broadening
        return family

    @property
    def moved(self) -> tuple[PerWavelength, PerWavelength]:
        """Zero, and the base: the transmission moves with the bands; see `MovedFamily`."""
        return np.zeros_like(self._base), self._base


class AbsorptionBands(Absorbing):
    """Modeled absorption bands, and an absorbance at all wavelengths."""

    kind = "absorption_bands"

    class Options(Section):
        """Options: number and form of the bands."""

        absorption_bands: int = Field(default=1, ge=1, le=8)
        """Number of absorption bands."""
        gaussian_in: GaussianIn = "wavenumber"
        """`wavenumber`: absorption bands are Gaussian in it, as those of dyes; or `wavelength`."""

    def __init__(
        self, wavelength_nm: PerWavelength, base: PerWavelength, bands: int, gaussian_in: GaussianIn = "wavenumber"
    ) -> None:
        super().__init__(wavelength_nm, base)
        self._count, self._in_wavelength = bands, gaussian_in == "wavelength"
        numbers = [""] if bands == 1 else [str(number) for number in range(1, bands + 1)]
        split = [name.name.partition("_") for name in _BANDS]
        named = [
            replace(known, name=f"{first}{number}{bar}{unit}")
            for number in numbers
            for known, (first, bar, unit) in zip(_BANDS, split, strict=True)
        ]
        self.parameters = (*named, _BASELINE)

    @classmethod
    def of_study(
        cls, wavelength_nm: PerWavelength, base: PerWavelength, target: PerWavelength | None, options: Section
    ) -> AbsorptionBands:
        """Make the family over curves of a study; see `Family.of_study`."""
        assert target is None
        assert isinstance(options, AbsorptionBands.Options)
        return AbsorptionBands(wavelength_nm, base, options.absorption_bands, options.gaussian_in)

    def _offsets(
        self, peaks_nm: Float[Array, " bands"], fwhm_nm: Float[Array, " bands"]
    ) -> Float[Array, "bands wavelengths"]:
        """Return the distances from the peaks in widths."""
        peak_nm, wave_nm = peaks_nm[..., None], self._nominal_nm
        away_nm = peak_nm - wave_nm if self._in_wavelength else (peak_nm / wave_nm - 1) * peak_nm
        return np.asarray(away_nm / fwhm_nm[..., None])

    def _split(
        self, x: Float[Array, "*batch parameters"]
    ) -> tuple[Float[Array, "*batch _bands"], Float[Array, "*batch _bands"], Float[Array, "*batch _bands"]]:
        """Return peak, width and absorbance of each band, as production makes them."""
        bands = x[..., :-1].reshape(*x.shape[:-1], self._count, len(_BANDS))
        return bands[..., 0], bands[..., 1] * self._width, bands[..., 2] / self._width

    def absorbance(self, x: DesignParameters) -> Float[Array, "designs wavelengths"]:
        """Return the absorbance; see `Absorbing.absorbance`."""
        peaks_nm, fwhm_nm, absorbance = self._split(x)
        total = np.repeat(x[..., -1:], self._wavelength_nm.size, axis=-1)
        for band in range(self._count):  # one after the other: a row alone is summed as in a block
            offsets = self._offsets(peaks_nm[..., band], fwhm_nm[..., band])
            total += absorbance[..., band, None] * np.exp(-GAUSSIAN * offsets**2)
        return total

    def absorbance_gradient(self, x: PerParameter) -> Float[Array, "parameters wavelengths"]:
        """Return the derivative of `absorbance`; see `Absorbing.absorbance_gradient`."""
        peaks_nm, fwhm_nm, absorbance = self._split(x)
        offsets = self._offsets(peaks_nm, fwhm_nm)
        shape = np.exp(-GAUSSIAN * offsets**2)
        slope = -2 * GAUSSIAN * absorbance[:, None] * offsets * shape
        wave_nm = self._nominal_nm
        by_peak = (1.0 if self._in_wavelength else 2 * peaks_nm[:, None] / wave_nm - 1) / fwhm_nm[:, None]
        by_fwhm = -slope * offsets / fwhm_nm[:, None]
        rows = np.stack([slope * by_peak, by_fwhm * self._width, shape / self._width], axis=1)
        return np.concatenate([rows.reshape(-1, shape.shape[1]), np.ones((1, shape.shape[1]))])

    def absorbance_range(self, low: PerParameter, high: PerParameter) -> tuple[PerWavelength, PerWavelength]:
        """Return every band where it is farthest and nearest; see `Absorbing.absorbance_range`."""
        wave_nm = self._nominal_nm
        (low_nm, narrowest_nm, least), (high_nm, widest_nm, most) = self._split(low), self._split(high)
        # An offset has its extremes at an end, at the wavelength, or, in wavenumber, at half of it.
        peaks_nm = [
            np.clip(at, low_nm[:, None], high_nm[:, None]) for at in (0.0 * wave_nm, wave_nm / 2, wave_nm, np.inf)
        ]
        peak_nm = np.stack([np.broadcast_to(each, peaks_nm[0].shape) for each in peaks_nm])
        away_nm = np.abs(peak_nm - wave_nm if self._in_wavelength else (peak_nm / wave_nm - 1) * peak_nm)
        farthest, nearest = away_nm.max(axis=0) / narrowest_nm[:, None], away_nm.min(axis=0) / widest_nm[:, None]
        ends = [
            end + (amount[:, None] * np.exp(-GAUSSIAN * offsets**2)).sum(axis=0)
            for end, amount, offsets in ((low[-1], least, farthest), (high[-1], most, nearest))
        ]
        return ends[0], ends[1]


class Mixture(Absorbing):
    """Colorants of a catalog in one film.

    `spectra`: absorbances with a peak of 1; `numbers`: ascending numbers of the spectra; left out, from 1 on.
    """

    kind = "mixture"

    class Options(Section):
        """Options: number of colorants."""

        at_most: int = Field(default=1, ge=1, le=3)
        """Largest number of colorants in one film."""

    def __init__(
        self,
        wavelength_nm: PerWavelength,
        base: PerWavelength,
        spectra: Float[Array, "spectra wavelengths"],
        at_most: int,
        numbers: Int[IndexArray, " colorants"] | None = None,
    ) -> None:
        super().__init__(wavelength_nm, base)
        self._spectra, self._slots = spectra, at_most
        self._most = spectra.max(axis=0)  # of the whole catalog, whatever is chosen
        self._numbers = np.arange(1, len(spectra) + 1) if numbers is None else numbers
        last = float(self._numbers[-1])
        self.parameters = (
            *(
                parameter
                for slot in range(1, at_most + 1)
                for parameter in (
                    Parameter(f"colorant_{slot}", 1, last, meaning="number of a colorant in the catalog"),
                    Parameter(f"absorbance_{slot}", 0, _MOST_ABSORBANCE, meaning="its decadic absorbance at the peak"),
                )
            ),
            Parameter("thickness_um", 0.01, 100, default=THICKNESS_UM, unit="um", meaning="thickness of the film"),
        )

    @property
    def slots(self) -> tuple[tuple[int, int], ...]:
        """Indices of number and absorbance of each colorant; see `ChoosingFamily`."""
        return tuple((at, at + 1) for at in range(0, 2 * self._slots, 2))

    def only(self, numbers: Int[IndexArray, " colorants"]) -> Self:
        """Return the family with some colorants of the catalog, under their numbers; see `ChoosingFamily`."""
        family = copy(self)
        family._spectra, family._numbers = self._spectra[np.searchsorted(self._numbers, numbers)], numbers
        return family

    def perturbed(self, production_error: ProductionError) -> Self:
        """Return the family with its spectra moved, and stretched about their peaks; see `Absorbing.perturbed`."""
        family = super().perturbed(production_error)
        wave_nm, nominal_nm, width = self._wavelength_nm, family._nominal_nm, family._width
        peaks_nm = wave_nm[self._spectra.argmax(axis=1)]
        stretched = [
            np.interp(peak_nm + (nominal_nm - peak_nm) / width, wave_nm, row) / width
            for peak_nm, row in zip(peaks_nm, self._spectra, strict=True)
        ]
        family._spectra = np.stack(stretched)
        family._most = np.interp(nominal_nm, wave_nm, self._most) if width == 1 else np.ones(wave_nm.size) / width
        return family

    def _chosen(self, x: Float[Array, "*batch parameters"]) -> Float[Array, "*batch _slots wavelengths"]:
        """Return the spectra of each slot."""
        return self._spectra[np.searchsorted(self._numbers, np.rint(x[..., : 2 * self._slots : 2]).astype(np.intp))]

    def absorbance(self, x: DesignParameters) -> Float[Array, "designs wavelengths"]:
        """Return the absorbance; see `Absorbing.absorbance`."""
        chosen, amounts = self._chosen(x), x[..., 1 : 2 * self._slots : 2]
        total = np.zeros((*x.shape[:-1], self._wavelength_nm.size))
        for slot in range(self._slots):
            total += amounts[..., slot, None] * chosen[..., slot, :]
        return np.asarray(x[..., -1:] / THICKNESS_UM * total, dtype=float)

    def absorbance_gradient(self, x: PerParameter) -> Float[Array, "parameters wavelengths"]:
        """Return the derivative of `absorbance`, 0 by a number; see `Absorbing.absorbance_gradient`."""
        rows = np.zeros((x.size, self._wavelength_nm.size))
        rows[1 : 2 * self._slots : 2] = self._chosen(x) * (x[-1] / THICKNESS_UM)
        rows[-1] = self.absorbance(x[None])[0] / x[-1]
        return rows

    def absorbance_range(self, low: PerParameter, high: PerParameter) -> tuple[PerWavelength, PerWavelength]:
        """Return the least and the largest of the colorants of each slot; see `Absorbing.absorbance_range`."""
        least, most = np.zeros((2, self._wavelength_nm.size))
        for number, amount in self.slots:
            inside = (self._numbers >= np.rint(low[number])) & (self._numbers <= np.rint(high[number]))
            least = least + low[amount] * self._spectra[inside].min(axis=0)
            most = most + high[amount] * self._spectra[inside].max(axis=0)
        return low[-1] / THICKNESS_UM * least, high[-1] / THICKNESS_UM * most

    def lower(self, low: PerParameter, high: PerParameter) -> ChannelCurves:
        """Return the base behind the largest absorbance of the whole catalog, whatever is chosen of it."""
        assert low.shape == high.shape
        amount = float(sum(high[amount] for _, amount in self.slots))
        most = self._film * high[-1] / THICKNESS_UM * amount * self._most
        return np.asarray((self._base * np.power(10.0, -most))[None], dtype=float)
