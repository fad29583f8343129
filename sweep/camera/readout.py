"""Readout of a scene: from expected electrons through full well, noise and ADC to digital numbers of the channels.

A channel is the mean over the disc, or the demosaicked center.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..base.types import Array, DesignCases, DesignPixels, Float, IndexArray, Int, PerDesign, SameShape
from .noise import merge, table
from .noise.pixel_curve import PixelCurve, groups_of, pixel_curve, same_electrons
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
            return self._merged_means(electrons) if noisy else merge.without_noise(electrons, light, pixel)
        clips, rounds = setup.computes("saturation"), setup.computes("quantization")
        if noisy and setup.computes("noise"):
            return (table.mean_rounded if rounds else table.mean_unrounded)(electrons, pixel)
        held = np.minimum(electrons, pixel.saturation_e) if clips else electrons
        if not rounds:
            return unquantized(held, pixel)
        if noisy:
            dn = unquantized(held, pixel)
            return dn + table.mean_rounded(electrons, pixel) - table.mean_unrounded(electrons, pixel)
        return rounded(held * pixel.dn_per_e, pixel)

    def _merged_means(self, electrons: Float[Array, "captures designs cases signals pixels"]) -> DesignPixels:
        """Return means of merged values: from a table where exposures have their fixed share of the electrons."""
        if (full_e := self._full_e(electrons)) is None:
            return merge.merged(electrons, self.capture_light_of(electrons), self.pixel).mean
        means = np.empty(full_e.shape)
        for curve, at in self._curves:
            means[..., at] = curve.mean(full_e[..., at])
        return means

    def _merged_moments(
        self, electrons: Float[Array, "captures designs cases signals pixels"]
    ) -> tuple[DesignPixels, DesignPixels]:
        """Return means and variances of merged values, from where means are."""
        if (full_e := self._full_e(electrons)) is None:
            values = merge.merged(electrons, self.capture_light_of(electrons), self.pixel)
            return values.mean, values.variance
        means, variances = np.empty(full_e.shape), np.empty(full_e.shape)
        for curve, at in self._curves:
            means[..., at], variances[..., at] = curve.moments(full_e[..., at])
        return means, variances

    @property
    def _curves(self) -> list[tuple[PixelCurve, Int[IndexArray, " _elements"]]]:
        """What groups of elements with the same light read over the electrons of a pixel of full sensitivity."""
        return [(pixel_curve(self.pixel, light, noisy=True), at) for light, at in groups_of(self.capture_light)]

    def _full_e(self, electrons: Float[Array, "captures designs cases signals pixels"]) -> DesignPixels | None:
        """Return electrons of a pixel of full sensitivity; None where exposures have no fixed share of them."""
        full_e = electrons[0] / self.capture_light_of(electrons)[0]
        shares = zip(electrons[1:], self.capture_light[1:], strict=True)
        return full_e if all(same_electrons(of_one, full_e, share) for of_one, share in shares) else None

    def capture_light_of(self, electrons: Float[Array, "captures ... pixels"]) -> Float[Array, "captures ... pixels"]:
        """Return the relative light of exposures, broadcast to their electrons."""
        shape = (len(electrons), *(1,) * (electrons.ndim - 2), electrons.shape[-1])
        return self.capture_light.reshape(shape)

    def variance_dn(self, electrons: SameShape) -> SameShape:
        """Return the variance of the digital numbers, with rounding, DN^2."""
        return table.variance(electrons, self.pixel)

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
            mean, variance = self._merged_moments(electrons)
            return self.folded(mean), self.spread(variance)
        dn, variance_dn = self.transfer(electrons), self.variance_dn(electrons)
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
