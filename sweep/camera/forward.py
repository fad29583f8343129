"""Forward model: light on the pixels, electrons, full well, readout, for a batch of designs.

Stages in physical order: optics, pixel aperture and mosaic sampling with crosstalk (the pixel response), photon noise,
full well, read noise, black level, ADC, readout. Effects that the setup leaves out are not computed.
"""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Callable, Iterator
from copy import copy
from dataclasses import replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from ..base.cache import Cache
from ..base.errors import SweepError, ValidationIssue
from ..base.types import Array, DesignCases, DesignCurves, DesignPixels, Float, IndexArray, Int, PerDesign
from ..designs.block import Block
from .brightness import LampReadings, of_case
from .electrons import Changing, Electrons
from .exposure import SceneLight
from .field import over_field
from .memory import blocks
from .phases import Phases, different_phases, scene_phases
from .pixel import unquantized
from .pixel_curve import is_noisy
from .pixel_response import ChannelResponses, PixelResponse, channel_responses, kept_response, pixel_response
from .readout import NoisyReadout, Readout
from .setup import Setup

_Result = TypeVar("_Result")
_BLOCK = 2_000_000
"""Values of a block of pixels that are held at once."""


class ForwardModel:
    """Forward model of one scene and camera; the pixel response is computed at its first use.

    `phases`: sampling phases instead of those of the scene.
    """

    together = False
    """True: the pixels of all field positions are held together."""

    def __init__(self, setup: Setup, phases: Phases | None = None, *, once: bool = False) -> None:
        """Store the setup, and split responses that are too large to hold at once."""
        self.setup = setup
        self._once = once
        # Parts whose pixels would be too many to hold together: field positions, or blocks of phases.
        self._positions: list[ForwardModel] = []
        self._phase_blocks: list[Phases] = []
        self._of_scene = phases is None
        self._latest: dict[str, tuple[bytes, Any]] = {}
        if phases is None and setup.scene.target is not None:
            phases = different_phases(setup, scene_phases(setup))[0]
        self.phases = phases
        if setup.linear or phases is None:
            return
        if setup.scene.field is not None and not self.together:
            self._positions = [type(self)(position, phases, once=once) for position in over_field(setup)]
            return
        phase_blocks = blocks(setup, phases)
        self._phase_blocks = phase_blocks if len(phase_blocks) > 1 else []

    def _parts(self) -> Iterator[ForwardModel]:
        """Yield the models of field positions, or of blocks of phases; nothing for an undivided model."""
        yield from self._positions
        yield from (type(self)(self.setup, block, once=True) for block in self._phase_blocks)

    @property
    def _in_parts(self) -> bool:
        return bool(self._positions or self._phase_blocks)

    def at(self, phases: Phases | None, moments: Float[Array, " moments"] | None = None) -> ForwardModel:
        """Return the model of the same scene at other phases, for a single use.

        `moments`: moments of a pulsed light, 0 (least light) to 1 (most light).
        """
        model = ForwardModel(self.setup, phases, once=True)
        for part, light in ((model, self.light), *((position, position.light) for position in model._positions)):
            part.__dict__["light"] = copy(light)
            part.light.moments = moments
        if self._of_channels:
            model.__dict__["_channels"] = self._channels
        return model

    @cached_property
    def light(self) -> SceneLight:
        """Light of the scene."""
        return SceneLight(self.setup)

    @cached_property
    def _response(self) -> PixelResponse:
        by_pixel = not self.setup.linear
        if self._of_channels:
            assert self.phases is not None
            return self._channels.at(self.setup, self.phases)
        if self._of_scene:
            return kept_response(self.setup, self.phases, by_pixel=by_pixel)
        return pixel_response(self.setup, self.phases, by_pixel=by_pixel)

    @property
    def _of_channels(self) -> bool:
        """True if each phase of a target's channels is kept on its own."""
        return self.setup.linear and self.setup.all_phases and self.setup.scene.field is None

    @cached_property
    def _channels(self) -> ChannelResponses:
        return channel_responses(self.setup)

    @cached_property
    def electrons(self) -> Electrons:
        """Expected electrons of designs."""
        return Electrons(self.light, self._response, once=self._once)

    @cached_property
    def readout(self) -> Readout:
        """Readout of the elements of the pixel response."""
        return Readout(self.setup, self._response)

    @property
    def n_cases(self) -> int:
        """Number of sampling phases times number of field positions."""
        if self._positions:
            return sum(position.n_cases for position in self._positions)
        return sum(map(len, self._phase_blocks)) or self._response.shape[0]

    def read_changing(self, block: Block) -> Changing | None:
        """Read designs that differ in one channel alone.

        Returns digital numbers, DN. None if the designs differ in more, or if a channel is read from several elements.
        """
        if self._in_parts or not self.readout.by_channel or self.setup.camera.pixel.captures:
            return None
        electrons = self.electrons.changing(block)
        if electrons is None:
            return None
        transfer = self.readout.transfer

        def make(part: slice) -> Float[Array, "_designs signals channels"]:
            return transfer(electrons.make(part))

        def unlit(part: slice) -> Float[Array, "designs cases pixels"]:
            return unquantized(electrons.unlit(part), self.readout.pixel)

        return replace(electrons, fixed=transfer(electrons.fixed), make=make, unlit=unlit)

    def unlit(self, curves: DesignCurves, exposure_s: PerDesign) -> Float[Array, "designs cases channels"]:
        """Return the response without the lamps: black level, dark current and background, unquantized, DN."""
        if self._in_parts:
            return np.concatenate([part.unlit(curves, exposure_s) for part in self._parts()], axis=1)
        electrons = self.electrons.unlit(curves) * exposure_s[:, None, None]
        dn = self.readout.folded(unquantized(electrons, self.readout.pixel)[:, :, None])[:, :, 0]
        return np.repeat(dn, self.light.scales(exposure_s).shape[-1], axis=1)

    def read(self, curves: DesignCurves) -> tuple[DesignCases, PerDesign]:
        """Read out a batch of designs.

        Returns `dn`: digital numbers, DN; means under noise; `exposure_s`: exposure time, s.
        """
        return self._read_once("read", curves, self._read)

    def _read(self, curves: DesignCurves) -> tuple[DesignCases, PerDesign]:
        exposure_s = self.light.exposure_s(curves)
        if self._in_parts:
            return np.concatenate([part.read(curves)[0] for part in self._parts()], axis=1), exposure_s
        dn = [self.readout.folded(self.readout.transfer(e)) for e in self._blocks(curves, exposure_s)]
        return np.concatenate(dn), exposure_s

    def _read_once(self, how: str, curves: DesignCurves, read: Callable[[DesignCurves], _Result]) -> _Result:
        """Return the result of `read`, and keep that of a single design, from which several tables are made."""
        if len(curves) != 1 or self._in_parts:
            return read(curves)
        requested = curves.tobytes()
        cached = self._latest.get(how)
        if cached is None or cached[0] != requested:
            cached = self._latest[how] = requested, read(curves)
        result: _Result = cached[1]
        return result

    def read_with_noise(self, curves: DesignCurves) -> NoisyReadout:
        """Read out a batch of designs with the variance of the noise.

        Pixels are read one by one: saturation and quantization must be computed.
        """
        return self._read_once("noise", curves, self._read_with_noise)

    def _read_with_noise(self, curves: DesignCurves) -> NoisyReadout:
        if self._in_parts:
            readouts = [part.read_with_noise(curves) for part in self._parts()]
            joined = {
                name: np.concatenate([getattr(readout, name) for readout in readouts], axis=1)
                for name in ("mean", "variance", "gaussian", "reach_dn")
            }
            return replace(readouts[0], **joined)
        exposure_s = self.light.exposure_s(curves)
        parts = [self.readout.with_noise(electrons) for electrons in self._blocks(curves, exposure_s)]
        mean, variance, gaussian, reach = (np.concatenate(values) for values in zip(*parts, strict=True))
        return NoisyReadout(mean, variance, gaussian, reach, exposure_s)

    def _blocks(
        self, curves: DesignCurves, exposure_s: PerDesign
    ) -> Iterator[Float[Array, "... cases signals pixels"]]:
        """Yield expected electrons of blocks of designs."""
        scales = self.light.scales(exposure_s)
        size = self.n_cases * scales.shape[-1] * len(self.light.signals) * self._response.shape[1]
        step = max(1, _BLOCK // size)
        for start in range(0, len(curves), step):
            block = slice(start, start + step)
            yield self._captured(curves[block], scales[..., block, :], exposure_s[block])

    def lamps(self, curves: DesignCurves) -> Iterator[LampReadings]:
        """Yield the readings of one design's lamps over their brightness, in each case; `curves` as of `read`."""
        if self._in_parts:
            for part in self._parts():
                yield from part.lamps(curves)
            return
        exposure_s = self.light.exposure_s(curves)
        scales = self.light.scales(exposure_s)
        electrons = self._captured(curves, scales, exposure_s)
        dark = self._captured(curves, scales, exposure_s, lit=False)
        if not self.setup.camera.pixel.captures:
            electrons, dark = electrons[None], dark[None]
        for case in range(electrons.shape[2]):
            readout = self.readout.at(case // scales.shape[-1])
            yield of_case(electrons[:, 0, case], dark[:, 0, case, 0], readout, noisy=is_noisy(self.setup))

    def _captured(
        self,
        curves: DesignCurves,
        scales: Float[Array, "... designs moments"],
        exposure_s: PerDesign,
        *,
        lit: bool = True,
    ) -> Float[Array, "*captures designs cases signals pixels"]:
        """Return expected electrons, or those without lamps; of an HDR pixel of each exposure, on the first axis."""

        def of(model: ForwardModel, curves: DesignCurves, scales: Float[Array, "designs moments"]) -> DesignPixels:
            electrons = model.electrons
            return (electrons.expected if lit else electrons.without_lamps)(curves, scales, exposure_s)

        if not self.setup.camera.pixel.captures:
            return of(self, curves, scales)
        modified, exposures = list(self.setup.camera.modified), self.setup.camera.pixel.exposures
        result, before, electrons = np.empty(0), None, np.empty(0)
        for at, ((factors, model), scale) in enumerate(zip(self._of_exposures, scales, strict=True)):
            if model is not before or not np.array_equal(scale, scales[at - 1]):
                electrons = of(model, curves * factors[modified, None], scale)
                if model.readout.by_channel and not self.readout.by_channel:
                    electrons = model.readout.of_pixels(electrons)
                before = model
            if not at:
                result = np.empty((len(exposures), *electrons.shape))
            np.multiply(electrons, exposures[at].capture.light, out=result[at])
        return result

    @cached_property
    def _of_exposures(self) -> list[tuple[Float[Array, " channels"], ForwardModel]]:
        """QE factors of the channels, and model of the electrons, of each exposure of an HDR pixel."""
        camera, models = self.setup.camera, []
        for exposure in camera.pixel.exposures:
            capture = exposure.capture
            factors = np.array([capture.qe_factor.get(channel, 1.0) for channel in camera.mosaic.channels])
            if capture.qe_factor or capture.crosstalk is not None:
                crosstalk = camera.pixel.crosstalk if capture.crosstalk is None else capture.crosstalk
                pixel = camera.pixel.model_copy(update={"crosstalk": crosstalk})
                changes = {"qe": camera.qe * factors[:, None], "pixel": pixel}
                model = type(self)(self.setup.with_camera(**changes), self.phases, once=self._once)
            else:
                model = self
            models.append((factors, model))
        return models

    def pixel_electrons(self, curves: DesignCurves) -> Float[Array, "*captures designs cases signals pixels"]:
        """Return expected electrons of the pixels that are read.

        For a patch that fills the field, the pixels of one tile, row by row. Of an HDR pixel those of each exposure, on
        the first axis. Raises SweepError if the pixels of all phases do not fit into memory.
        """
        if self._phase_blocks:
            most = f"at most those of {len(self._phase_blocks[0])} sampling phases: a smaller light, or a named phase"
            raise SweepError(ValidationIssue("too many pixels to draw", value=f"{self.n_cases} phases", allowed=most))
        if self._in_parts:
            return np.concatenate([part.pixel_electrons(curves) for part in self._parts()], axis=-3)
        exposure_s = self.light.exposure_s(curves)
        return self.readout.of_pixels(self._captured(curves, self.light.scales(exposure_s), exposure_s))

    def channels_of(self, pixels: Float[Array, "signals pixels"], case: int) -> Float[Array, "signals channels"]:
        """Return the channels from their pixels at one phase and field position.

        `pixels`: values of the pixels of `pixel_electrons`.
        """
        for position in self._positions:
            if case < position.n_cases:
                return position.channels_of(pixels, case)
            case -= position.n_cases
        return self.readout.channels_of(pixels, case)

    @property
    def capture_light(self) -> Float[Array, "captures pixels"] | None:
        """Relative light of exposures on `pixel_electrons`; None for a pixel read once."""
        return self.readout.of_pixels(self.readout.capture_light) if self.setup.camera.pixel.captures else None

    @property
    def few_pixels(self) -> tuple[Int[IndexArray, " _pixels"], ...] | None:
        """Pixels whose mean is each channel; None for a target, or if they are many."""
        return None if self.setup.scene.target is not None else self.readout.few_pixels


_models: Cache[tuple[type[ForwardModel], bytes], ForwardModel] = Cache(4)
_known: Cache[tuple[type[ForwardModel], int], tuple[Setup, ForwardModel]] = Cache(4)
"""Models of the last blocks' setups, by the identity of the setup, which is immutable."""


def forward_model(setup: Setup, kind: type[ForwardModel] = ForwardModel) -> ForwardModel:
    """Return the forward model of a setup; recent models are cached."""

    def build() -> tuple[Setup, ForwardModel]:
        return setup, _models.get((kind, hashlib.sha256(pickle.dumps(setup)).digest()), lambda: kind(setup))

    return _known.get((kind, id(setup)), build)[1]
