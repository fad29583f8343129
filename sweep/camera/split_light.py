"""The light of single pixels in factors: what falls on each different place of a pixel, and which pixels are there.

A pixel takes its own light, and with crosstalk some of its neighbors', each through the filter there. The image is
round, so that many pixels of many places of the light see the same. Electrons are summed over the wavelengths once for
each of these places and each filter, and then gathered.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..base.types import FloatArray, IndexArray


@dataclass(frozen=True)
class SplitLight:
    """`PixelResponse.light` of pixels, ndarray[n_cases, n_units, n_channels, n_wavelengths], in factors.

    `values`: functions of the light at each different place, ndarray[n_places, n_functions]; `shares`: how much of each
    is in each wavelength, ndarray[n_functions, n_wavelengths], None where all see the same; `factor`: of the light's
    way, ndarray[n_wavelengths]. A pixel is a sum of parts: `parts`: how much of each, ndarray[n_parts]; `place`: where
    it is, ndarray[n_parts, n_cases, n_units]; `through`: whose filter it has, ndarray[n_parts, n_units].
    """

    values: FloatArray
    shares: FloatArray | None
    factor: FloatArray
    parts: FloatArray
    place: IndexArray
    through: IndexArray
    n_channels: int

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """That of the array."""
        return (*self.place.shape[1:], self.n_channels, self.factor.size)

    def whole(self) -> FloatArray:
        """The array itself."""
        by_place = (self.values if self.shares is None else self.values @ self.shares) * self.factor
        found = np.zeros(self.shape)
        pixels = np.arange(self.place.shape[2])
        for share, place, through in zip(self.parts, self.place, self.through, strict=True):
            found[:, pixels, through] += share * by_place[place]
        return found

    def _seen(self, spectra: FloatArray) -> FloatArray:
        """Sums over the wavelengths at each place: ndarray[..., n, n_wavelengths] -> ndarray[..., n_places, n]."""
        seen = spectra * self.factor
        by_function = seen.sum(axis=-1, keepdims=True) if self.shares is None else seen @ self.shares.T
        return np.asarray(self.values @ np.swapaxes(by_function, -1, -2), dtype=float)

    def add_sums(self, spectra: FloatArray, channels: Sequence[int], found: FloatArray) -> None:
        """Add sums over channels and wavelengths to `found`, ndarray[n_designs, n_cases, n_signals, n_units].

        `spectra`: QE times signals, ndarray[n_designs, n_channels, n_signals, n_wavelengths], of the `channels`. Other
        designs change one by no more than rounding.
        """
        from .compiled_split import gather  # noqa: PLC0415  (compiled: kept off the start-up path)

        row = np.full(self.n_channels, -1)
        row[list(channels)] = np.arange(len(channels))
        gather(np.ascontiguousarray(self._seen(spectra)), self.parts, self.place, row[self.through], found)

    def folded(self, weights: FloatArray, channel: int) -> FloatArray:
        """Weighted sums over the units of what they get through one channel's filter, ndarray[n_cases, n_wavelengths].

        `weights`: ndarray[n_cases, n_units].
        """
        by_place = np.zeros((len(weights), len(self.values)))
        for share, place, through in zip(self.parts, self.place, self.through, strict=True):
            own = np.flatnonzero(through == channel)
            for case in range(len(weights)):
                np.add.at(by_place[case], place[case, own], share * weights[case, own])
        seen = by_place @ self.values
        return np.asarray((seen if self.shares is None else seen @ self.shares) * self.factor, dtype=float)
