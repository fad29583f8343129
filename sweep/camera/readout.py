"""Readout of a scene: from expected electrons through full well, noise and ADC to digital numbers of the channels.

A channel is the mean over the disc, or the demosaicked center.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..base.types import Array, DesignCases, DesignPixels, Float, IndexArray, Int, PerDesign
from .noise import merge
from .noise.law import groups_of, pixel_law, read_once_law, same_electrons
from .noise.rounding import rounded
from .pixel import Pixel, unquantized
from .response import PixelResponse
from .setup import Setup

_CERTAIN_DN2 = 1e-9


@dataclass(frozen=True)
class NoisyReadout:
    """Readout with noise.

    `mean`, `variance`: mean, DN, and variance, DN^2, of each channel.
    """

    mean: DesignCases
    variance: DesignCases
    exposure_s: PerDesign


def capture_light(setup: Setup, response: PixelResponse) -> Float[Array, "captures pixels"]:
    """Return the light of each exposure of an HDR pixel relative to that of a pixel of full sensitivity."""
    channels = setup.camera.mosaic.channels
    of_element = [channels[at] for at in response.readout.max(axis=0).argmax(axis=1)]
    captures = [exposure.capture for exposure in setup.camera.pixel.exposures]
    light = [[capture.light * capture.qe_factor.get(channel, 1.0) for channel in of_element] for capture in captures]
    return np.array(light, dtype=float).reshape(len(captures), len(of_element))


@dataclass(frozen=True)
class Readout:
    """Readout of the elements of a pixel response.

    `weights`, `spread_weights`: of each element in the value of each channel and in its variance; `capture_light`:
    light of the exposures of an HDR pixel on the elements.
    """

    setup: Setup
    weights: Float[Array, "cases pixels channels"]
    spread_weights: Float[Array, "cases pixels channels"]
    capture_light: Float[Array, "captures pixels"]
    by_channel: bool

    @classmethod
    def of(cls, setup: Setup, response: PixelResponse) -> Readout:
        """Return the readout of a response."""
        light = capture_light(setup, response)
        return cls(setup, response.readout, response.spread, light, response.by_channel)

    def subset(self, which: slice | Int[IndexArray, " subset"]) -> Readout:
        """Return the readout at some sampling phases."""
        return replace(self, weights=self.weights[which], spread_weights=self.spread_weights[which])

    @property
    def pixel(self) -> Pixel:
        """The pixel that is read."""
        return self.setup.camera.pixel

    @property
    def n_cases(self) -> int:
        """Number of sampling phases."""
        return len(self.weights)

    def transfer(self, electrons: Float[Array, "... pixels"]) -> Float[Array, "... pixels"]:
        """Convert expected electrons to digital numbers; under noise, to their means, DN.

        `electrons`: expected electrons of the elements; of an HDR pixel those of each exposure, on the first axis.
        """
        setup, pixel = self.setup, self.pixel
        noisy = setup.scene.noise is not None
        if pixel.captures:
            light = self.capture_light_of(electrons)
            return self._merged(electrons, 1)[0] if noisy else merge.without_noise(electrons, light, pixel)
        clips, rounds = setup.computes("saturation"), setup.computes("quantization")
        if is_noisy(setup):
            return np.asarray(read_once_law(pixel, rounds=rounds).at(0, electrons, 1)[0])
        held = np.minimum(electrons, pixel.saturation_e) if clips else electrons
        if not rounds:
            return unquantized(held, pixel)
        if noisy:
            means = [read_once_law(pixel, rounds=rounds).at(0, electrons, 1)[0] for rounds in (True, False)]
            return np.asarray(unquantized(held, pixel) + means[0] - means[1])
        return rounded(held * pixel.dn_per_e, pixel)

    def _merged(
        self, electrons: Float[Array, "captures designs cases signals pixels"], rows: int
    ) -> list[DesignPixels]:
        """Return means and variances of merged values: by a law where exposures have their fixed share of electrons."""
        if (full_e := self._full_e(electrons)) is None:
            values = merge.merged(electrons, self.capture_light_of(electrons), self.pixel)
            return [values.mean, values.variance][:rows]
        result, groups = np.empty((rows, *full_e.shape)), groups_of(self.capture_light)
        law = pixel_law(self.pixel, tuple(light for light, _ in groups))
        for number, (_, at) in enumerate(groups):
            result[..., at] = law.at(number, full_e[..., at], rows)
        return [*result]

    def _full_e(self, electrons: Float[Array, "captures designs cases signals pixels"]) -> DesignPixels | None:
        """Return electrons of a pixel of full sensitivity; None where exposures have no fixed share of them."""
        full_e = electrons[0] / self.capture_light_of(electrons)[0]
        shares = zip(electrons[1:], self.capture_light[1:], strict=True)
        return full_e if all(same_electrons(of_one, full_e, share) for of_one, share in shares) else None

    def capture_light_of(self, electrons: Float[Array, "captures ... pixels"]) -> Float[Array, "captures ... pixels"]:
        """Return the relative light of exposures, broadcast to their electrons."""
        shape = (len(electrons), *(1,) * (electrons.ndim - 2), electrons.shape[-1])
        return self.capture_light.reshape(shape)

    def folded(self, dn: Float[Array, "designs ... pixels"]) -> Float[Array, "designs ... channels"]:
        """Combine the elements to channels, DN.

        `dn`: digital numbers, DN.
        """
        return dn if self.by_channel else self._weighed(dn, self.weights)

    def spread(self, variance: DesignPixels) -> DesignCases:
        """Combine variances of the elements to those of the channels, DN^2.

        `variance`: variance, DN^2.
        """
        return self._weighed(variance, self.spread_weights)

    def with_noise(
        self, electrons: Float[Array, "*captures designs cases signals pixels"]
    ) -> tuple[DesignCases, DesignCases]:
        """Return mean and variance of a block with noise.

        `electrons`: expected electrons; elements are pixels. Of an HDR pixel those of each exposure, on the first axis.
        """
        if self.pixel.captures:
            mean, variance = self._merged(electrons, 2)
            return self.folded(mean), self.spread(variance)
        dn, variance_dn = read_once_law(self.pixel).at(0, electrons, 2)
        # A digital number that is the same in all but one of a billion readouts: what is left of its noise is
        # rounding of the arithmetic, by which two signals would seem separated with certainty.
        certain = variance_dn < _CERTAIN_DN2
        dn, variance_dn = np.where(certain, np.rint(dn), dn), np.where(certain, 0.0, variance_dn)
        return self.folded(dn), self.spread(variance_dn)

    def of_pixels(self, values: Float[Array, " ..."]) -> Float[Array, " ..."]:
        """Return values of the pixels of a tile, row by row, from those of channels that fill the field."""
        if self.by_channel and self.setup.scene.target is None:
            return values[..., self.setup.camera.mosaic.indices.ravel()]
        return values

    def _weighed(self, values: DesignPixels, weights: Float[Array, "_positions pixels channels"]) -> DesignCases:
        """Sum over the elements with weights."""
        repeats = values.shape[1] // self.n_cases
        return np.asarray(values @ np.repeat(weights, repeats, axis=0))


def is_noisy(setup: Setup) -> bool:
    """Return whether readings are means under noise."""
    return setup.scene.noise is not None and setup.computes("noise")
