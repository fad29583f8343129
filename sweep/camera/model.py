"""Model of a scene: from light to digital numbers, for a batch of designs.

Place, light and readout are chosen once (`place`, `light`, `readout`): lamps behind air and lens at an image height,
their image on the mosaic, electrons of each exposure at each moment of a pulse, digital numbers of pixels, means of
channels. Effects that the setup leaves out are not computed. A case is a field position, a sampling phase and a moment
of a pulse, in this order.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property, lru_cache

import numpy as np

from ..base.types import Array, DesignCases, DesignCurves, Float, FloatArray, PerDesign
from ..designs.block import Block
from . import place
from .along import Along, AlongReadings
from .brightness import LampReadings
from .electrons import Dark, Lit, View
from .exposure import exposure_times, fixed_white, white_irradiance
from .field import field_heights, scene_at
from .image import in_cases
from .light import Steady, alike, different, light_of
from .phases import Phases, different_phases, scene_phases
from .pixel import unquantized
from .readout import NoisyReadout, exposures_of, is_noisy, light_of_elements, readout_of, whole_exposure
from .setup import Setup

_BLOCK = 2_000_000
"""Values of a block of elements that are held at once."""


class SceneModel:
    """Model of one scene and camera, for any designs; what it computes of the scene it keeps."""

    def __init__(self, setup: Setup) -> None:
        self.setup = setup
        self.heights = field_heights(setup)
        self.phases: Phases | None = None
        if setup.scene.target is not None:
            self.phases = different_phases(setup, scene_phases(setup))[0]
        self.exposures, self.light = exposures_of(setup), light_of(setup)
        self.readout = readout_of(setup, self.exposures)
        self._whole = whole_exposure(setup) if setup.camera.pixel.captures else self.exposures[0]
        self._positions: dict[float, place.Position] = {}
        self._moments: Float[Array, " moments"] | None = None
        self.n_cases = len(self.heights) * (1 if self.phases is None else len(self.phases))
        """Number of sampling phases times number of field positions."""

    def at(self, views: Sequence[View], moments: Float[Array, " moments"] | None = None) -> SceneModel:
        """Return the model at some views of the scene, and at moments of a pulse instead of those of the accuracy."""
        other = copy(self)
        other.__dict__ |= {"own_views": [*views], "_along": None}
        other._moments = moments
        other.n_cases = sum(view.image.n_cases for view in views)
        return other

    @cached_property
    def white(self) -> FloatArray:
        """Electrons/s on the white patch per unit of QE."""
        return white_irradiance(self.setup) * self.setup.camera.area_bins_m2_nm

    @cached_property
    def fixed_white(self) -> float:
        """Electrons/s on the white patch in the brightest channel that no design modifies."""
        return fixed_white(self.setup)

    @property
    def own_moments(self) -> bool:
        """True for the moments of a pulse that the accuracy states."""
        return self._moments is None

    def exposure_s(self, curves: DesignCurves) -> PerDesign:
        """Return the exposure time of each design."""
        return exposure_times(self.setup, curves @ self.white, self.fixed_white)

    def position(self, height: float) -> place.Position:
        """Return lamps and filters at an image height."""
        if height not in self._positions:
            scene = self.setup.scene
            at = self.setup if scene.field is None else replace(self.setup, scene=scene_at(scene, height))
            self._positions[height] = place.Position(at)
        return self._positions[height]

    def views(
        self,
        phases: Phases | None = None,
        heights: Sequence[float] | None = None,
        *,
        by_pixel: bool | None = None,
    ) -> Iterator[View]:
        """Yield the views of each field position, in parts whose pixels fit into memory.

        `phases`, `heights`: instead of those of the scene; `by_pixel`: keep single pixels; left out, if the readout is
        not linear.
        """
        by_pixel = not self.setup.linear if by_pixel is None else by_pixel
        phases = self.phases if phases is None else phases
        if phases is None:
            images = [place.chart(self.setup, by_pixel=by_pixel)]
        else:
            images = place.targets(self.setup, phases, by_pixel=by_pixel)
        for height in self.heights if heights is None else heights:
            for image in images:
                yield View(self.setup, self.position(height), image)

    @cached_property
    def own_views(self) -> list[View]:
        """Views of the scene's own cases."""
        return [*self.views()]

    def scales(self, exposure_s: PerDesign) -> Float[Array, "exposures designs moments"]:
        """Return the light relative to its mean at the moments of a pulse: those of `at`, or of the accuracy."""
        return self.light.scales(exposure_s, self._moments)

    def read(self, curves: DesignCurves) -> tuple[DesignCases, PerDesign]:
        """Read out a batch of designs.

        Returns `dn`: digital numbers, DN; means under noise; `exposure_s`: exposure time, s.
        """
        exposure_s = self.exposure_s(curves)
        scales = self.scales(exposure_s)
        first, which = different(scales)
        parts = []
        for view in self.own_views:
            channel, parts_of = view.image.channel, list[Float[Array, "places channels designs moments signals"]]()
            for electrons in self._blocks(view, curves, scales[..., first], exposure_s):
                parts_of.append(view.image.folded(self.readout.mean(electrons, channel)))
            parts.append(in_cases(np.concatenate(parts_of, axis=2)))
        dn = np.concatenate(parts, axis=1)
        return dn[:, np.arange(dn.shape[1]).reshape(-1, first.size)[:, which].ravel()], exposure_s

    def read_with_noise(self, curves: DesignCurves) -> NoisyReadout:
        """Read out a batch of designs with the variance of the noise.

        Pixels are read one by one: saturation and quantization must be computed.
        """
        exposure_s = self.exposure_s(curves)
        scales, means, variances = self.scales(exposure_s), [], []
        for view in self.own_views:
            read = []
            for electrons in self._blocks(view, curves, scales, exposure_s):
                mean, variance = self.readout.moments(electrons, view.image.channel)
                read.append((view.image.folded(mean), view.image.spread(variance)))
            mean, variance = (in_cases(np.concatenate(of_blocks, axis=2)) for of_blocks in zip(*read, strict=True))
            means.append(mean)
            variances.append(variance)
        return NoisyReadout(np.concatenate(means, axis=1), np.concatenate(variances, axis=1), exposure_s)

    def _blocks(
        self, view: View, curves: DesignCurves, scales: Float[Array, "exposures designs moments"], exposure_s: PerDesign
    ) -> Iterator[Float[Array, "exposures elements _designs moments signals"]]:
        """Yield expected electrons of blocks of designs."""
        size = view.image.channel.size * scales.shape[2] * len(self.setup.lights.names)
        step = max(1, _BLOCK // size)
        for start in range(0, len(curves), step):
            block = slice(start, start + step)
            lit, dark = self._electrons(view, curves[block], exposure_s[block])
            yield lit[:, :, :, None] * scales[:, None, block, :, None] + dark[..., None, None]

    def _electrons(
        self, view: View, curves: DesignCurves, exposure_s: PerDesign
    ) -> tuple[Float[Array, "exposures elements designs signals"], Float[Array, "exposures elements designs"]]:
        """Return expected electrons of the lamps with the mean light of their pulses, and without lamps."""
        lit, dark = list[Lit](), list[Dark]()
        for at, exposure in enumerate(self.exposures):
            known = exposure.same_as < at
            lit.append(lit[exposure.same_as] if known else view.rates(curves, exposure))
            dark.append(dark[exposure.same_as] if known else view.unlit(curves, exposure))
        times = np.array([exposure.light for exposure in self.exposures])[:, None] * exposure_s
        lit_e, dark_e = np.stack(lit), np.stack(dark)
        lit_e *= times[:, None, :, None]
        dark_e *= times[:, None]
        return lit_e, dark_e

    def along(self, block: Block) -> AlongReadings | None:
        """Read designs that differ in one channel alone; those whose modified channel sets the exposure are left out.

        None if the designs differ in more, or if the scene has no such way.
        """
        return None if self._along is None else self._along.read(block)

    @cached_property
    def _along(self) -> Along | None:
        fast = isinstance(self.light, Steady) and Along.applies(self.setup, self.own_views)
        return Along(self.own_views, self.exposures[0], self.readout, self.white, self.fixed_white) if fast else None

    def unlit(self, curves: DesignCurves, exposure_s: PerDesign) -> Float[Array, "designs cases channels"]:
        """Return the response without the lamps: black level, dark current and background, unquantized, DN."""
        parts = []
        for view in self.own_views:
            electrons = view.unlit(curves, self._whole) * exposure_s
            parts.append(view.image.folded(unquantized(electrons, self.setup.camera.pixel)))
        unlit = np.moveaxis(np.concatenate(parts), 2, 0)
        return np.repeat(unlit, self.scales(exposure_s).shape[-1], axis=1)

    def lamps(self, curves: DesignCurves) -> Iterator[LampReadings]:
        """Yield the readings of one design's lamps over their brightness; `curves` as of `read`.

        Cases whose lamps differ in brightness alone, as the moments of a pulse, are one.
        """
        exposure_s = self.exposure_s(curves)
        scales, case = self.scales(exposure_s), 0
        moments, readout, noisy = alike(scales), self.readout, is_noisy(self.setup)
        for view in self.own_views:
            light = light_of_elements(self.exposures, view.image.channel)
            lit, dark = self._electrons(view, curves, exposure_s)
            lit_e, dark_e = np.swapaxes(lit[:, :, 0], 1, 2), dark[..., 0]
            for of_case in range(view.image.n_cases):
                used, weights, spread, n_pixels = view.image.of_case(of_case)
                lit_here, dark_here, light_here = lit_e[..., used], dark_e[:, used], light[:, used]
                for numbers, factors in moments:
                    then_e = lit_here * scales[:, 0, numbers[0], None, None]
                    cases = [case + number for number in numbers]
                    elements = then_e, dark_here, light_here, weights, spread
                    yield LampReadings(*elements, readout.pixel, noisy, readout.proportional, n_pixels, cases, factors)
                case += scales.shape[-1]

    def pixel_electrons(self, curves: DesignCurves) -> Float[Array, "exposures designs cases signals elements"]:
        """Return expected electrons of the elements in each case of a light that fills the field."""
        exposure_s = self.exposure_s(curves)
        scales = self.scales(exposure_s)
        parts = [np.concatenate([*self._blocks(view, curves, scales, exposure_s)], axis=2) for view in self.own_views]
        return np.concatenate([np.moveaxis(part, 1, -1) for part in parts], axis=2)


@lru_cache(maxsize=8)
def scene_model(setup: Setup) -> SceneModel:
    """Return the model of a setup, which owns it: recent ones are kept."""
    return SceneModel(setup)
