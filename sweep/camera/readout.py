"""Readout of a pixel: from expected electrons through full well, noise and ADC to digital numbers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..base.types import Array, DesignCurves, Float, IndexArray, Int, PerChannel, PerDesign, SameShape
from .noise import merge
from .noise.law import groups_of, pixel_law, read_once_law
from .noise.rounding import rounded
from .pixel import Pixel, unquantized
from .sampling import crosstalk_share
from .setup import Setup

_CERTAIN_DN2 = 1e-9
Electrons = Float[Array, "exposures elements *batch"]
"""Expected electrons in each exposure of a pixel; one that is read once has one."""
Channel = Int[IndexArray, " elements"]
"""Channel of each element."""
CaptureLight = Float[Array, "exposures elements"]
"""Light of the exposures of elements, relative to a pixel of full sensitivity."""
Numbers = Float[Array, "elements *batch"]
"""Digital numbers of elements, DN, or their variances, DN^2."""


@dataclass(frozen=True, eq=False)
class Exposure:
    """Electrons that a pixel collects at a time.

    `light`: relative to a pixel of full sensitivity in the scene's exposure time; `factors`: on the QE of the channels;
    `same_as`: number of the first exposure with the same electrons/s, but for the sensitivity.
    """

    light: float
    factors: PerChannel
    crosstalk: float
    same_as: int = 0

    def seen(self, qe: DesignCurves, channels: Sequence[int]) -> DesignCurves:
        """Return the QE of channels in the exposure."""
        factors = self.factors[list(channels)]
        return qe if (factors == 1).all() else qe * factors[:, None]


def whole_exposure(setup: Setup) -> Exposure:
    """Return the exposure of a pixel of full sensitivity."""
    return Exposure(1.0, np.ones(len(setup.camera.mosaic.channels)), crosstalk_share(setup))


def exposures_of(setup: Setup) -> list[Exposure]:
    """Return the exposures of a scene's pixel."""
    whole, exposures = whole_exposure(setup), list[Exposure]()
    if not setup.camera.pixel.captures:
        return [whole]
    for capture, _ in setup.camera.pixel.exposures:
        factors = np.array([capture.qe_factor.get(channel, 1.0) for channel in setup.camera.mosaic.channels])
        crosstalk = whole.crosstalk
        if crosstalk and capture.crosstalk is not None:
            crosstalk = capture.crosstalk
        same = [of.same_as for of in exposures if of.crosstalk == crosstalk and (of.factors == factors).all()]
        exposures.append(Exposure(capture.light, factors, crosstalk, same[0] if same else len(exposures)))
    return exposures


def light_of_elements(exposures: Sequence[Exposure], channel: Channel) -> CaptureLight:
    """Return the light of exposures on elements, relative to a pixel of full sensitivity."""
    return np.stack([exposure.light * exposure.factors[channel] for exposure in exposures])


@dataclass(frozen=True)
class NoisyReadout:
    """Readout with noise.

    `mean`, `variance`: mean, DN, and variance, DN^2, of each channel.
    """

    mean: Float[Array, "designs cases signals channels"]
    variance: Float[Array, "designs cases signals channels"]
    exposure_s: PerDesign


@dataclass(frozen=True)
class ReadOnce:
    """A pixel that is read once; `convert`: from its electrons to digital numbers, under noise to their means."""

    pixel: Pixel
    convert: Callable[[SameShape], SameShape]
    proportional = True

    def mean(self, electrons: Electrons, channel: Channel) -> Numbers:  # noqa: ARG002
        """Return digital numbers; under noise their means."""
        return self.convert(electrons[0])

    def moments(self, electrons: Electrons, channel: Channel) -> tuple[Numbers, Numbers]:  # noqa: ARG002
        """Return means and variances."""
        dn, variance_dn = read_once_law(self.pixel).at(0, electrons[0], 2)
        # A digital number that is the same in all but one of a billion readouts: what is left of its noise is
        # rounding of the arithmetic, by which two signals would seem separated with certainty.
        certain = variance_dn < _CERTAIN_DN2
        return np.where(certain, np.rint(dn), dn), np.where(certain, 0.0, variance_dn)


@dataclass(frozen=True)
class Merged:
    """An HDR pixel, whose captures are merged to one value; as `ReadOnce` otherwise.

    `proportional`: all exposures have their fixed share of the electrons; no pulse, crosstalk or QE tells them apart.
    """

    pixel: Pixel
    exposures: Sequence[Exposure]
    noisy: bool
    proportional: bool

    def mean(self, electrons: Electrons, channel: Channel) -> Numbers:
        """Return digital numbers; under noise their means."""
        light = light_of_elements(self.exposures, channel)
        if self.noisy:
            return self._moments(electrons, light, 1)[0]
        return merge.without_noise(electrons, _beside(light, electrons), self.pixel)

    def moments(self, electrons: Electrons, channel: Channel) -> tuple[Numbers, Numbers]:
        """Return means and variances."""
        mean, variance = self._moments(electrons, light_of_elements(self.exposures, channel), 2)
        return mean, variance

    def _moments(self, electrons: Electrons, light: CaptureLight, rows: int) -> Sequence[Numbers]:
        """Return means and variances, by a law of the electrons of a pixel of full sensitivity if there is one."""
        if not self.proportional:
            values = merge.merged(electrons, _beside(light, electrons), self.pixel)
            return [values.mean, values.variance][:rows]
        full_e, groups = electrons[0] / _beside(light, electrons)[0], groups_of(light)
        law = pixel_law(self.pixel, tuple(of_group for of_group, _ in groups))
        result = np.empty((rows, *full_e.shape))
        for number, (_, at) in enumerate(groups):
            result[:, at] = law.at(number, full_e[at], rows)
        return [*result]


def _beside(light: CaptureLight, electrons: Electrons) -> Float[Array, "exposures elements ..."]:
    return light.reshape(*light.shape, *(1,) * (electrons.ndim - 2))


Readout = ReadOnce | Merged


def readout_of(setup: Setup, exposures: Sequence[Exposure]) -> Readout:
    """Return how the pixel of a scene is read."""
    pixel, noisy = setup.camera.pixel, setup.scene.noise is not None
    if pixel.captures:
        return Merged(pixel, exposures, noisy, _proportional(setup, exposures))
    clips, rounds = setup.computes("saturation"), setup.computes("quantization")
    most_e = pixel.saturation_e if clips else np.inf

    def held(electrons: SameShape) -> SameShape:
        return unquantized(np.minimum(electrons, most_e), pixel)

    def mean(electrons: SameShape) -> SameShape:
        return np.asarray(read_once_law(pixel, rounds=rounds).at(0, electrons, 1)[0])

    def dithered(electrons: SameShape) -> SameShape:
        means = [read_once_law(pixel, rounds=of_steps).at(0, electrons, 1)[0] for of_steps in (True, False)]
        return np.asarray(held(electrons) + means[0] - means[1])

    def whole(electrons: SameShape) -> SameShape:
        return rounded(np.minimum(electrons, most_e) * pixel.dn_per_e, pixel)

    if is_noisy(setup):
        return ReadOnce(pixel, mean)
    if rounds:
        return ReadOnce(pixel, dithered if noisy else whole)
    return ReadOnce(pixel, held)


def _proportional(setup: Setup, exposures: Sequence[Exposure]) -> bool:
    """Return whether all exposures of an HDR pixel have their fixed share of the electrons."""
    pixel = setup.camera.pixel
    windows = {(capture.start_ratio, capture.exposure_ratio) for capture, _ in pixel.exposures}
    pulsed = setup.scene.drive is not None and setup.computes("flicker")
    if len({exposure.crosstalk for exposure in exposures}) > 1 or (pulsed and len(windows) > 1):
        return False
    alike = all((exposure.factors == exposures[0].factors).all() for exposure in exposures)
    return alike or not (exposures[0].crosstalk or pixel.dark_e_per_s)


def is_noisy(setup: Setup) -> bool:
    """Return whether readings are means under noise."""
    return setup.scene.noise is not None and setup.computes("noise")
