"""The forward model: light on the pixels, electrons, full well, readout, for a block of designs.

In the physical order: optics, pixel aperture and mosaic sampling with crosstalk (the pixel response), photon noise,
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
from ..base.errors import Fault, SweepError
from ..base.types import FloatArray, IndexArray
from ..designs.block import Block
from .electrons import Changing, Electrons
from .exposure import SceneLight
from .field import over_field
from .memory import blocks
from .phases import Phases, different_phases, scene_phases
from .pixel_response import ChannelResponses, PixelResponse, channel_responses, kept_response, pixel_response
from .readout import NoisyReadout, Readout
from .setup import Setup

_Result = TypeVar("_Result")
_BLOCK = 2_000_000
"""Values of a block of pixels that are held at once."""


class ForwardModel:
    """A scene, ready for designs; the pixel response is made once it is asked for.

    `phases`: the sampling phases of a light, None of one that fills the field; of those that see the same, one.
    `light`: the scene's; `electrons`: what the designs give on the elements of the response; `readout`: how these are
    read.
    """

    all_apart, together = False, False
    """True: all phases are kept; True: the pixels of all field positions are held together."""

    def __init__(self, setup: Setup, phases: Phases | None = None, *, once: bool = False) -> None:
        """`phases`: sampling phases instead of the scene's. `once`: for a single use, so that no table is made."""
        self.setup = setup
        self._once = once
        # Parts whose pixels would be too many to hold together: field positions, or blocks of phases.
        self._positions: list[ForwardModel] = []
        self._phase_blocks: list[Phases] = []
        self._of_scene = phases is None
        self._latest: dict[str, tuple[bytes, Any]] = {}
        if phases is None and setup.scene.target is not None:
            phases = scene_phases(setup)
            phases = phases if self.all_apart else different_phases(setup, phases)[0]
        self.phases = phases
        if setup.linear or phases is None:
            return
        if setup.scene.field is not None and not self.together:
            self._positions = [type(self)(position, phases, once=once) for position in over_field(setup)]
            return
        phase_blocks = blocks(setup, phases)
        self._phase_blocks = phase_blocks if len(phase_blocks) > 1 else []

    def _parts(self) -> Iterator[ForwardModel]:
        """Models of the field positions, or of the blocks of phases, made as they are read; none of a whole model."""
        yield from self._positions
        yield from (type(self)(self.setup, block, once=True) for block in self._phase_blocks)

    @property
    def _in_parts(self) -> bool:
        return bool(self._positions or self._phase_blocks)

    def at(self, phases: Phases | None, moments: FloatArray | None = None) -> ForwardModel:
        """The same scene at other phases, and other moments of a pulse (see `pwm.scales`), for a single use."""
        model, light = ForwardModel(self.setup, phases, once=True), copy(self.light)
        light.moments = moments
        model.__dict__["light"] = light
        if self._of_channels:
            model.__dict__["_channels"] = self._channels
        return model

    @cached_property
    def light(self) -> SceneLight:
        """The light of the scene."""
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
        """True where the response is that of a target's channels, whose phases are kept one by one."""
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
        """The readout of the elements."""
        return Readout(self.setup, self._response)

    @property
    def n_cases(self) -> int:
        """Sampling phases times field positions."""
        if self._positions:
            return sum(position.n_cases for position in self._positions)
        return sum(map(len, self._phase_blocks)) or self._response.shape[0]

    def read_changing(self, block: Block) -> Changing | None:
        """`Electrons.changing` as read, DN; None, too, where a channel is read from several elements."""
        if self._in_parts or not self.readout.by_channel:
            return None
        electrons = self.electrons.changing(block)
        if electrons is None:
            return None
        transfer = self.readout.transfer

        def make(part: slice) -> FloatArray:
            return transfer(electrons.make(part))

        return replace(electrons, fixed=transfer(electrons.fixed), make=make)

    def read(self, curves: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The readout, DN, ndarray[n_designs, n_cases, n_signals, n_channels], and exposure, s, ndarray[n_designs]."""
        return self._read_once("read", curves, self._read)

    def _read(self, curves: FloatArray) -> tuple[FloatArray, FloatArray]:
        exposure_s = self.light.exposure_s(curves)
        if self._in_parts:
            return np.concatenate([part.read(curves)[0] for part in self._parts()], axis=1), exposure_s
        dn = [self.readout.folded(self.readout.transfer(e)) for e in self._blocks(curves, exposure_s)]
        return np.concatenate(dn), exposure_s

    def _read_once(self, how: str, curves: FloatArray, read: Callable[[FloatArray], _Result]) -> _Result:
        """Result of `read`; that of a single design is kept, since several tables are made of it in a row."""
        if len(curves) != 1 or self._in_parts:
            return read(curves)
        asked = curves.tobytes()
        kept = self._latest.get(how)
        if kept is None or kept[0] != asked:
            kept = self._latest[how] = asked, read(curves)
        result: _Result = kept[1]
        return result

    def read_with_noise(self, curves: FloatArray) -> NoisyReadout:
        """The readout as from `read`, with its variance and what errors need to know of it.

        Pixels are read one by one, so neither saturation nor quantization may be left out.
        """
        return self._read_once("noise", curves, self._read_with_noise)

    def _read_with_noise(self, curves: FloatArray) -> NoisyReadout:
        if self._in_parts:
            readouts = [part.read_with_noise(curves) for part in self._parts()]
            joined = {
                name: np.concatenate([getattr(one, name) for one in readouts], axis=1)
                for name in ("mean", "variance", "gaussian", "reach_dn")
            }
            return replace(readouts[0], **joined)
        exposure_s = self.light.exposure_s(curves)
        parts = [self.readout.with_noise(electrons) for electrons in self._blocks(curves, exposure_s)]
        mean, variance, gaussian, reach = (np.concatenate(values) for values in zip(*parts, strict=True))
        return NoisyReadout(mean, variance, gaussian, reach, exposure_s)

    def _blocks(self, curves: FloatArray, exposure_s: FloatArray) -> Iterator[FloatArray]:
        """`Electrons.expected` of blocks of designs."""
        scales = self.light.scales(exposure_s)
        size = self.n_cases * scales.shape[1] * len(self.light.signals) * self._response.shape[1]
        step = max(1, _BLOCK // size)
        for start in range(0, len(curves), step):
            block = slice(start, start + step)
            yield self.electrons.expected(curves[block], scales[block], exposure_s[block])

    def pixel_electrons(self, curves: FloatArray) -> FloatArray:
        """Expected electrons of the pixels that are read, ndarray[n_designs, n_cases, n_signals, n_pixels].

        Of a light that fills the field, the pixels of one tile, row by row. Raises SweepError where the pixels of all
        phases do not fit into memory.
        """
        if self._phase_blocks:
            most = f"at most those of {len(self._phase_blocks[0])} places: a smaller light, or a named place"
            raise SweepError(Fault("too many pixels to draw", value=f"{self.n_cases} places", allowed=most))
        if self._in_parts:
            return np.concatenate([part.pixel_electrons(curves) for part in self._parts()], axis=1)
        exposure_s = self.light.exposure_s(curves)
        result = self.electrons.expected(curves, self.light.scales(exposure_s), exposure_s)
        if self.readout.by_channel and self.setup.scene.target is None:
            return result[..., self.setup.camera.mosaic.indices.ravel()]
        return result

    def channels_of(self, pixels: FloatArray, case: int) -> FloatArray:
        """`Readout.channels_of` at a phase and field position."""
        for position in self._positions:
            if case < position.n_cases:
                return position.channels_of(pixels, case)
            case -= position.n_cases
        return self.readout.channels_of(pixels, case)

    @property
    def few_pixels(self) -> tuple[IndexArray, ...] | None:
        """`Readout.few_pixels`; None where a target's pixels are many."""
        return None if self.setup.scene.target is not None else self.readout.few_pixels


class AllPhases(ForwardModel):
    """A forward model of all phases, for what tells a phase from its mirror image: pixels that are drawn one by one."""

    all_apart = True


_models: Cache[tuple[type[ForwardModel], bytes], ForwardModel] = Cache(16)
_known: Cache[tuple[type[ForwardModel], int], tuple[Setup, ForwardModel]] = Cache(4)
"""Models of the last blocks' setups, by the identity of the setup, which nobody changes."""


def forward_model(setup: Setup, kind: type[ForwardModel] = ForwardModel) -> ForwardModel:
    """The forward model of a setup; the latest ones are kept, so that a response is made once in a process."""

    def made() -> tuple[Setup, ForwardModel]:
        return setup, _models.get((kind, hashlib.sha256(pickle.dumps(setup)).digest()), lambda: kind(setup))

    return _known.get((kind, id(setup)), made)[1]
