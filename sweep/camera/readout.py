"""The readout of a scene: from expected electrons through full well, noise and ADC to the channels' digital numbers.

Only what `Setup.methods` names is computed. A channel is the mean over the disc, or the demosaicked center.
"""

from __future__ import annotations

from collections import Counter

import numpy as np

from ..types import BoolArray, FloatArray, IndexArray
from .effects import noise_table, quantization, saturation
from .kernel import Kernel
from .noisy_readout import is_cut, is_gaussian, reach_dn
from .pixel import Pixel, unquantized
from .view import Setup

_CERTAIN_DN2 = 1e-9
_FEW = 16


class Readout:
    """How a camera reads a kernel's units. `work` counts the values that are computed, by effect.

    `pixel`: without a pedestal where that is skipped.
    """

    def __init__(self, setup: Setup, kernel: Kernel, work: Counter[str]) -> None:
        self.setup = setup
        self.n_cases, n_units = kernel.light.shape[:2]
        self._weights, self._spread = kernel.readout, kernel.spread
        self._work = work
        pixel = setup.pixel
        without = setup.methods.pedestal == "skip"
        self.pixel: Pixel = pixel.model_copy(update={"offset_dn": 0.0}) if without else pixel
        self.by_tile = setup.scenario.target is None and n_units == len(setup.mosaic.channels)
        """Whether the units are the channels of a tile, of a light that fills the field."""
        self.by_channel = setup.methods.straight or self.by_tile
        """Whether each unit is a channel already."""

    def transfer(self, electrons: FloatArray) -> FloatArray:
        """Digital numbers of the units from their expected electrons, as far as the methods go."""
        methods, noisy, pixel = self.setup.methods, self.setup.scenario.noise is not None, self.pixel
        soft, rounds = noisy and methods.noise == "expected", methods.quantization != "skip"
        if methods.saturation == "skip":
            dn = unquantized(electrons, pixel)
        elif soft:
            self._work["noise"] += electrons.size
            dn = (noise_table.rounded if rounds else noise_table.unrounded)(electrons, pixel)
        else:
            self._work["saturation"] += electrons.size
            dn = unquantized(saturation.clipped(electrons, pixel), pixel)
        if not rounds:
            return dn
        self._work["quantization"] += electrons.size
        if soft and methods.saturation != "skip":
            return dn
        if noisy:
            return dn + noise_table.rounded(electrons, pixel) - noise_table.unrounded(electrons, pixel)
        held = electrons if methods.saturation == "skip" else saturation.clipped(electrons, pixel)
        return quantization.rounded(held * pixel.dn_per_e, pixel)

    def variance_dn(self, electrons: FloatArray) -> FloatArray:
        """Variance of the units' digital numbers, DN^2, with their rounding."""
        self._work["variance"] += electrons.size
        return noise_table.variance(electrons, self.pixel)

    def folded(self, dn: FloatArray) -> FloatArray:
        """Value of each channel from those of the units: the last axis n_units -> n_channels."""
        return dn if self.by_channel else self._weighed(dn, self._weights)

    def with_noise(self, electrons: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray, FloatArray]:
        """`NoisyReadout.mean`, `variance`, `gaussian` and `reach_dn` of a block.

        Pixels are read one by one, so saturation and quantization must be among the setup's methods.
        """
        dn, variance_dn = self.transfer(electrons), self.variance_dn(electrons)
        # A digital number that is the same in all but one of a billion readouts: what is left of its noise is
        # rounding of the arithmetic, by which two signals would seem told apart for certain.
        certain = variance_dn < _CERTAIN_DN2
        dn, variance_dn = np.where(certain, np.rint(dn), dn), np.where(certain, 0.0, variance_dn)
        mean, variance = self.folded(dn), self._weighed(variance_dn, self._spread)
        return (mean, variance, *self._shape_of_noise(electrons, variance))

    def channels_of(self, pixels: FloatArray, place: int) -> FloatArray:
        """Readout of each channel from its pixels (those of `Imager.pixel_electrons`) at a place of the light.

        ndarray[n, n_pixels] -> ndarray[n, n_channels].
        """
        setup = self.setup
        if setup.scenario.target is None:
            own = setup.mosaic.indices.ravel()[:, None] == np.arange(len(setup.mosaic.channels))
            return np.asarray(pixels @ (own / setup.mosaic.counts), dtype=float)
        return np.asarray(pixels @ self._weights[place], dtype=float)

    @property
    def few_pixels(self) -> tuple[IndexArray, ...] | None:
        """For each channel the pixels of `Imager.pixel_electrons` of which it is the mean; None where they are many."""
        setup = self.setup
        if setup.scenario.target is not None or setup.mosaic.counts.max() > _FEW:
            return None
        channels = setup.mosaic.indices.ravel()
        return tuple(np.flatnonzero(channels == at) for at in range(len(setup.mosaic.channels)))

    def _weighed(self, values: FloatArray, weights: FloatArray) -> FloatArray:
        """Sums over the units by their `weights`, ndarray[n_cases, n_units, n_channels]."""
        self._work["readout"] += values.size
        repeats = values.shape[1] // self.n_cases
        return np.asarray(values @ np.repeat(weights, repeats, axis=0))

    def _shape_of_noise(self, electrons: FloatArray, variance: FloatArray) -> tuple[BoolArray, FloatArray]:
        """`NoisyReadout.gaussian` and `reach_dn` of a block."""
        repeats = electrons.shape[1] // self.n_cases
        heaviest = self._weights.max(axis=1) if self.setup.scenario.target else 1 / self.setup.mosaic.counts[None]
        heaviest = np.repeat(np.broadcast_to(heaviest, (self.n_cases, variance.shape[-1])), repeats, axis=0)[:, None]
        cut = self._weighed(is_cut(electrons, self.pixel), (self._weights > 0).astype(float)) > 0
        return is_gaussian(variance, heaviest, cut, self.pixel), reach_dn(electrons, self.pixel) * heaviest
