"""Model of a scene: from light to digital numbers, for a batch of designs.

Stages in physical order: optics, pixel aperture and mosaic sampling with crosstalk (`response`), photons to electrons
(`electrons`), photon noise, full well, read noise, black level, ADC and readout (`readout`). Effects that the setup
leaves out are not computed. A case is a field position, a sampling phase and a moment of a pulse, in this order.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from ..base.errors import SweepError, ValidationIssue
from ..base.types import (
    Array,
    Bool,
    BoolArray,
    DesignCases,
    DesignCurves,
    DesignPixels,
    Float,
    FloatArray,
    IndexArray,
    Int,
    PerDesign,
)
from ..designs.block import Block
from . import pwm
from .brightness import LampReadings, alike_pixels, of_case
from .electrons import Electrons, FieldPosition
from .exposure import exposure_times, fixed_white, white_irradiance
from .field import field_heights, scene_at
from .memory import blocks
from .phases import Phases, different_phases, scene_phases
from .pixel import unquantized
from .readout import NoisyReadout, Readout, is_noisy
from .response import responses_of, uniform_response
from .sampling import crosstalk_share
from .setup import Setup

_BLOCK = 2_000_000
"""Values of a block of pixels that are held at once."""
_KEPT = 15_000_000
"""Largest table of one channel's rates in all cases."""


@dataclass(frozen=True)
class View:
    """Phases of a scene at one field position, and how their electrons are read.

    `exposures`: of each exposure of an HDR pixel, factors on the QE of the channels, and its electrons.
    """

    electrons: Electrons
    exposures: tuple[tuple[Float[Array, " channels"], Electrons], ...]
    readout: Readout

    def subset(self, which: slice | Int[IndexArray, " subset"]) -> View:
        """Return the view of some phases."""
        exposures = tuple((factors, electrons.subset(which)) for factors, electrons in self.exposures)
        return View(self.electrons.subset(which), exposures, self.readout.subset(which))

    def captured(
        self,
        curves: DesignCurves,
        scales: Float[Array, "... designs moments"],
        exposure_s: PerDesign,
        *,
        lit: bool = True,
    ) -> Float[Array, "*captures designs cases signals pixels"]:
        """Return expected electrons, or those without lamps; of an HDR pixel of each exposure, on the first axis."""

        def of(electrons: Electrons, curves: DesignCurves, scales: Float[Array, "designs moments"]) -> DesignPixels:
            return (electrons.expected if lit else electrons.without_lamps)(curves, scales, exposure_s)

        if not self.exposures:
            return of(self.electrons, curves, scales)
        camera = self.readout.setup.camera
        modified, captures = list(camera.modified), [exposure.capture for exposure in camera.pixel.exposures]
        result, before, read = np.empty(0), None, np.empty(0)
        for at, ((factors, electrons), scale) in enumerate(zip(self.exposures, scales, strict=True)):
            if electrons is not before or not np.array_equal(scale, scales[at - 1]):
                read, before = of(electrons, curves * factors[modified, None], scale), electrons
            if not at:
                result = np.empty((len(captures), *read.shape))
            np.multiply(read, captures[at].light, out=result[at])
        return result


@dataclass(frozen=True)
class Changing:
    """Readings of designs that differ in one channel alone.

    `fixed`: DN of the shared channels; those of `channel` are undefined; `make`: from a slice of the designs to DN of
    that channel; `unlit`: to all channels without the lamps; `exposure_s`: of all of them; `which`: designs of the
    batch that these are.
    """

    fixed: Float[Array, "cases signals channels"]
    channel: int
    make: Callable[[slice], Float[Array, "_designs cases signals"]]
    exposure_s: float
    which: Bool[BoolArray, " designs"]
    unlit: Callable[[slice], Float[Array, "_designs cases channels"]]

    def whole(self, part: slice) -> DesignCases:
        """Return all channels of some designs."""
        values = self.make(part)
        all_channels = np.repeat(self.fixed[None], len(values), axis=0)
        all_channels[..., self.channel] = values
        return all_channels


class SceneModel:
    """Model of one scene and camera, for any designs; what it computes of the scene it keeps."""

    def __init__(self, setup: Setup) -> None:
        self.setup = setup
        self.heights = field_heights(setup)
        self.phases: Phases | None = None
        if setup.scene.target is not None:
            self.phases = different_phases(setup, scene_phases(setup))[0]
        self._positions: dict[tuple[float, int], FieldPosition] = {}
        self._moments: Float[Array, " moments"] | None = None
        self.n_cases = len(self.heights) * (1 if self.phases is None else len(self.phases))
        """Number of sampling phases times number of field positions."""

    def at(self, views: Sequence[View], moments: Float[Array, " moments"] | None = None) -> SceneModel:
        """Return the model at some views of the scene, and at moments of a pulse instead of those of the accuracy."""
        other = copy(self)
        other.__dict__.update(_kept=list(views), _along=None)
        other._moments = moments
        other.n_cases = sum(view.readout.n_cases for view in views)
        return other

    @cached_property
    def _white(self) -> tuple[FloatArray, float]:
        """Electrons/s on the white patch per unit of QE, and in the brightest channel that no design modifies."""
        return white_irradiance(self.setup) * self.setup.camera.area_bins_m2_nm, fixed_white(self.setup)

    @property
    def own_moments(self) -> bool:
        """True for the moments of a pulse that the accuracy states."""
        return self._moments is None

    def exposure_s(self, curves: DesignCurves) -> PerDesign:
        """Return the exposure time of each design."""
        white, fixed = self._white
        return exposure_times(self.setup, curves @ white, fixed)

    @property
    def white(self) -> FloatArray:
        """Electrons/s on the white patch per unit of QE."""
        return self._white[0]

    def position(self, height: float, exposure: int = 0) -> FieldPosition:
        """Return light and filters at a field position; `exposure`: of an HDR pixel, whose QE and crosstalk count."""
        key = height, exposure
        if key not in self._positions:
            setup = self._exposed[exposure][1] if self._exposed else self.setup
            scene = setup.scene if setup.scene.field is None else scene_at(setup.scene, height)
            self._positions[key] = FieldPosition(replace(setup, scene=scene))
        return self._positions[key]

    @cached_property
    def _exposed(self) -> list[tuple[Float[Array, " channels"], Setup]]:
        """QE factors of the channels, and setup, of each exposure of an HDR pixel; first the pixel itself."""
        camera = self.setup.camera
        exposed = [(np.ones(len(camera.mosaic.channels)), self.setup)]
        for exposure in camera.pixel.exposures:
            capture = exposure.capture
            factors = np.array([capture.qe_factor.get(channel, 1.0) for channel in camera.mosaic.channels])
            crosstalk = camera.pixel.crosstalk if capture.crosstalk is None else capture.crosstalk
            pixel = camera.pixel.model_copy(update={"crosstalk": crosstalk})
            exposed.append((factors, self.setup.with_camera(qe=camera.qe * factors[:, None], pixel=pixel)))
        return exposed

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
        parts: list[Phases | None] = [None]
        if phases is not None:
            parts = [*blocks(self.setup, phases)] if by_pixel else [phases]
        for height in self.heights if heights is None else heights:
            for part in parts:
                yield self._view(height, part, by_pixel=by_pixel)

    def _view(self, height: float, phases: Phases | None, *, by_pixel: bool) -> View:
        single = by_pixel and crosstalk_share(self.setup) > 0

        def electrons(exposure: int) -> Electrons:
            position = self.position(height, exposure)
            if phases is None:
                return Electrons(position, uniform_response(position.setup, by_pixel=single))
            responses = responses_of(position.setup)
            return Electrons(position, (responses.pixels if by_pixel else responses.channels)(phases))

        of_pixel = electrons(0)
        exposures = []
        for number, (factors, setup) in enumerate(self._exposed[1:], 1):
            same = (factors == 1).all() and setup.camera.pixel.crosstalk == self.setup.camera.pixel.crosstalk
            exposures.append((factors, of_pixel if same else electrons(number)))
        return View(of_pixel, tuple(exposures), Readout.of(self.setup, of_pixel.response))

    @cached_property
    def _kept(self) -> list[View] | None:
        """Views of the scene's own cases; None if they do not fit into memory together."""
        fits = self.phases is None or self.setup.linear or len([*blocks(self.setup, self.phases)]) == 1
        return [*self.views()] if fits else None

    def own_views(self) -> Iterator[View]:
        """Yield the views of the scene's own cases."""
        return iter(self.views() if self._kept is None else self._kept)

    def scales(self, exposure_s: PerDesign) -> Float[Array, "... designs moments"]:
        """Return the light relative to its mean at the moments of a pulse, of an HDR pixel for each exposure.

        Those of `at`, or those of the accuracy (see `pwm`).
        """
        if self.setup.camera.pixel.captures:
            scales = pwm.exposure_scales(self.setup, exposure_s, self._moments)
            return scales[..., np.sort(_different_moments(scales)[0])] if self._moments is None else scales
        return pwm.scales(self.setup, exposure_s, self._moments)

    def read(self, curves: DesignCurves) -> tuple[DesignCases, PerDesign]:
        """Read out a batch of designs.

        Returns `dn`: digital numbers, DN; means under noise; `exposure_s`: exposure time, s.
        """
        exposure_s = self.exposure_s(curves)
        scales = self.scales(exposure_s)
        first, which = _different_moments(scales)
        scales = scales[..., first]
        parts = []
        for view in self.own_views():
            electrons = self._blocks(view, curves, scales, exposure_s)
            parts.append(np.concatenate([view.readout.folded(view.readout.transfer(of_some)) for of_some in electrons]))
        dn = np.concatenate(parts, axis=1)
        return dn[:, np.arange(dn.shape[1]).reshape(-1, first.size)[:, which].ravel()], exposure_s

    def read_with_noise(self, curves: DesignCurves) -> NoisyReadout:
        """Read out a batch of designs with the variance of the noise.

        Pixels are read one by one: saturation and quantization must be computed.
        """
        exposure_s = self.exposure_s(curves)
        scales = self.scales(exposure_s)
        parts = []
        for view in self.own_views():
            read = [view.readout.with_noise(e) for e in self._blocks(view, curves, scales, exposure_s)]
            parts.append([np.concatenate(values) for values in zip(*read, strict=True)])
        mean, variance = (np.concatenate(values, axis=1) for values in zip(*parts, strict=True))
        return NoisyReadout(mean, variance, exposure_s)

    def _blocks(
        self, view: View, curves: DesignCurves, scales: Float[Array, "... designs moments"], exposure_s: PerDesign
    ) -> Iterator[Float[Array, "... cases signals pixels"]]:
        """Yield expected electrons of blocks of designs."""
        size = np.prod(view.electrons.response.shape) * scales.shape[-1] * len(self.setup.lights.names)
        step = max(1, _BLOCK // int(size))
        for start in range(0, len(curves), step):
            block = slice(start, start + step)
            yield view.captured(curves[block], scales[..., block, :], exposure_s[block])

    def unlit(self, curves: DesignCurves, exposure_s: PerDesign) -> Float[Array, "designs cases channels"]:
        """Return the response without the lamps: black level, dark current and background, unquantized, DN."""
        parts = []
        for view in self.own_views():
            electrons = view.electrons.unlit(curves) * exposure_s[:, None, None]
            parts.append(view.readout.folded(unquantized(electrons, view.readout.pixel)[:, :, None])[:, :, 0])
        return np.repeat(np.concatenate(parts, axis=1), self.scales(exposure_s).shape[-1], axis=1)

    def changing(self, block: Block) -> Changing | None:
        """Read designs that differ in one channel alone; those whose modified channel sets the exposure are left out.

        None if the designs differ in more, if a channel is read from several elements, or if the light is pulsed.
        """
        setup, views = self.setup, self._kept
        if setup.camera.pixel.captures or len(setup.camera.modified) != 1 or views is None:
            return None
        columns = [view.electrons for view in views]
        if any(electrons.one_element is None for electrons in columns) or self._along is None:
            return None
        products = block.product(self._along, np.arange(setup.camera.grid.size))
        white, *of_views = np.split(products, np.cumsum([1, *(e.along.shape[1] for e in columns[:-1])]), axis=1)
        time_s = exposure_times(setup, np.zeros((1, 1)), self._white[1])
        which = np.ones(len(block), dtype=bool)
        if white.max(initial=0.0) > self._white[1]:
            which = exposure_times(setup, white, self._white[1]) == time_s
        if not which.any() or not np.isfinite(time_s[0]) or self.scales(time_s).shape[1] > 1:
            return None
        if not which.all():
            of_views = [of_view[which] for of_view in of_views]
        rates_of, channel = [*zip(columns, of_views, strict=True)], int(columns[0].one_element or 0)
        readout = views[0].readout
        nothing = np.zeros((1, *setup.camera.base_qe.shape))
        dark = [electrons.unlit(nothing)[0] for electrons in columns]
        rest = [electrons.fixed + unlit[:, None] for electrons, unlit in zip(columns, dark, strict=True)]
        exposure_s, dark_e = float(time_s[0]), np.concatenate(dark) * time_s[0]

        def make(part: slice) -> Float[Array, "_designs cases signals"]:
            electrons = [of.expected_along(rates[part], exposure_s) for of, rates in rates_of]
            return readout.transfer(electrons[0] if len(rates_of) == 1 else np.concatenate(electrons, axis=1))

        def unlit(part: slice) -> Float[Array, "designs cases channels"]:
            of_channel = np.concatenate([of.unlit_along(rates[part]) for of, rates in rates_of], axis=1)
            electrons = np.repeat(dark_e[None], len(of_channel), axis=0)
            electrons[..., channel] = of_channel * exposure_s
            return unquantized(electrons, readout.pixel)

        fixed = readout.transfer(np.concatenate(rest) * time_s[0])
        return Changing(fixed, channel, make, exposure_s, which, unlit)

    @cached_property
    def _along(self) -> FloatArray | None:
        """Weights of the one modified channel: white, then what its electrons need in each view; None if too many."""
        columns = [view.electrons for view in self._kept or ()]
        signals, size = len(self.setup.lights.names), self.setup.camera.grid.size
        if sum(electrons.response.shape[0] for electrons in columns) * signals * size > _KEPT:
            return None
        return np.concatenate([self._white[0][:, None], *(electrons.along for electrons in columns)], axis=1)

    def lamps(self, curves: DesignCurves) -> Iterator[LampReadings]:
        """Yield the readings of one design's lamps over their brightness; `curves` as of `read`.

        Cases whose lamps differ in brightness alone, as the moments of a pulse, are one.
        """
        exposure_s = self.exposure_s(curves)
        scales = self.scales(exposure_s)
        moments, case = _alike_moments(scales), 0
        different = scales[..., [of_moments[0] for of_moments, _ in moments]]
        for view in self.own_views():
            electrons = view.captured(curves, different, exposure_s)
            dark = view.captured(curves, different, exposure_s, lit=False)
            if not self.setup.camera.pixel.captures:
                electrons, dark = electrons[None], dark[None]
            for phase in range(electrons.shape[2] // len(moments)):
                readout = view.readout.subset(slice(phase, phase + 1))
                part = slice(phase * len(moments), (phase + 1) * len(moments))
                lit, unlit = electrons[:, 0, part], dark[:, 0, part, 0]
                alike = alike_pixels(lit.sum(axis=1), unlit.sum(axis=1), readout)  # at every moment of a pulse
                for at, (numbers, of_scale) in enumerate(moments):
                    cases = [case + number for number in numbers]
                    of_cases = of_case(lit[:, at], unlit[:, at], readout, alike, noisy=is_noisy(self.setup))
                    yield replace(of_cases, cases=cases, scales=of_scale)
                case += scales.shape[-1]

    def pixel_electrons(self, curves: DesignCurves) -> Float[Array, "*captures designs cases signals pixels"]:
        """Return expected electrons of the pixels that are read.

        For a patch that fills the field, the pixels of one tile, row by row. Of an HDR pixel those of each exposure, on
        the first axis. Raises SweepError if the pixels of all phases do not fit into memory.
        """
        if self._kept is None:
            raise too_many(self, "too many pixels to draw")
        exposure_s = self.exposure_s(curves)
        scales = self.scales(exposure_s)
        parts = [view.readout.of_pixels(view.captured(curves, scales, exposure_s)) for view in self._kept]
        return np.concatenate(parts, axis=-3)

    @property
    def readout(self) -> Readout:
        """Readout of the scene's first cases."""
        return next(self.own_views()).readout


def too_many(model: SceneModel, problem: str) -> SweepError:
    """Return the error of a scene whose single pixels do not fit into memory together."""
    assert model.phases is not None
    first = next(iter(blocks(model.setup, model.phases)))
    most = f"at most those of {len(first)} sampling phases: a smaller light, or a named phase"
    return SweepError(ValidationIssue(problem, value=f"{model.n_cases} phases", allowed=most))


def _different_moments(
    scales: Float[Array, "... designs moments"],
) -> tuple[Int[IndexArray, " different"], Int[IndexArray, " moments"]]:
    """Return the first moment of each light in all designs and exposures, and which of these each moment has."""
    flat = np.round(scales.reshape(-1, scales.shape[-1]), 12)
    _, first, which = np.unique(flat, axis=1, return_index=True, return_inverse=True)
    return first, which.ravel()


def _alike_moments(scales: Float[Array, "... 1 moments"]) -> list[tuple[list[int], list[float]]]:
    """Return groups of moments whose light differs by one factor in all exposures: brightest first, and the factors."""
    columns = scales.reshape(-1, scales.shape[-1])
    most = columns.max(axis=0)
    kinds = np.round(columns / np.maximum(most, 1e-300), 12).T.tolist()
    groups: dict[tuple[float, ...], list[int]] = {}
    brightest = np.argsort(-most, kind="stable").tolist()
    for moment in brightest:
        lit = most[moment] > 0 or not groups
        groups.setdefault(tuple(kinds[moment]) if lit else next(iter(groups)), []).append(moment)
    return [(numbers, (most[numbers] / (most[numbers[0]] or 1.0)).tolist()) for numbers in groups.values()]


@lru_cache(maxsize=8)
def scene_model(setup: Setup) -> SceneModel:
    """Return the model of a setup, which owns it: recent ones are kept."""
    return SceneModel(setup)
