"""A batch of designs in a scene: what metrics ask for, each computed once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np

from ..base.types import (
    Array,
    Bool,
    BoolArray,
    DesignCases,
    DesignCurves,
    DesignParameters,
    DesignSignals,
    Float,
    MemberNumbers,
    PerChannel,
    PerDesign,
)
from ..camera.along import AlongReadings
from ..camera.brightness import LampReadings, room_dn, room_of
from ..camera.model import SceneModel, scene_model
from ..camera.readout import NoisyReadout
from ..camera.setup import Setup
from ..designs.block import Block, CurveBlock
from ..designs.family import Family
from ..spectra.lights import Pair, class_pairs
from .brightness import Walk, curves_of
from .quantity import Columns
from .separation import MANY, pixel_roots

_AT_ONCE = 1024
"""Designs that differ in one channel alone, or readouts of a design in a case, that are looked at at once."""
DistanceKind = Literal["DN", "pixel", "noise"]
"""Distances of lamps of any brightness: in DN, with every pixel counted, or in units of the noise."""
_READ_AT_ONCE = 2**19
"""Digital numbers that metrics are given at once: 4 MiB, so that they stay in the cache."""


@dataclass(frozen=True)
class CaseReadings:
    """Digital numbers of designs, each row of a design in one case, DN; `dark`: those without lamps.

    Of designs that differ in one `channel` alone, `values` are its numbers, and `fixed` those of the others; of
    others, `whole` are the numbers of all channels.
    """

    setup: Setup
    pairs: Sequence[Pair]
    dark: Float[Array, "designs channels"]
    whole: DesignSignals | None = None
    fixed: Float[Array, "signals channels"] | None = None
    channel: int = 0
    values: Float[Array, "designs signals"] | None = None

    @cached_property
    def dn(self) -> DesignSignals:
        """Digital numbers of all channels, with the pedestal."""
        if self.whole is not None:
            return self.whole
        assert self.fixed is not None
        assert self.values is not None
        whole = np.repeat(self.fixed[None], len(self.values), axis=0)
        whole[..., self.channel] = self.values
        return whole

    @cached_property
    def room_dn(self) -> PerDesign:
        """Chromatic distance up to which the closed form holds, DN."""
        if self.whole is not None:
            return room_dn(self.setup, self.whole, self.dark)
        assert self.fixed is not None
        assert self.values is not None
        others, dark = np.delete(self.fixed, self.channel, axis=1), self.dark[:, self.channel]
        lit = np.delete(self.fixed - self.dark[0], self.channel, axis=1).max(axis=1, initial=-np.inf)
        most_dn = np.maximum(self.values.max(axis=1), others.max(initial=-np.inf))
        least_dn = np.maximum(self.values - dark[:, None], lit).min(axis=1)
        return room_of(self.setup, most_dn, least_dn, self.dark.min(axis=1), self.dark.max(axis=1))

    def times(self, factors: PerChannel) -> CaseReadings:
        """Return the readings with each channel multiplied."""
        dark = self.dark * factors
        if self.whole is not None:
            return replace(self, dark=dark, whole=self.whole * factors)
        assert self.fixed is not None
        assert self.values is not None
        return replace(self, dark=dark, fixed=self.fixed * factors, values=self.values * factors[self.channel])


@dataclass
class Batch:
    """Designs in a scene, and what of them is wanted.

    `states`: signal types that noise may confuse; `pairs`: those whose chromatic distances are wanted; `family`,
    `points`: of the designs, if they are of one; `noisy`: columns under noise are wanted; `any_brightness`: of states
    of any brightness, too; `columns`: those that are known; `by_case`: those of each case; `walks`: along the
    brightness of the lamps of designs.
    """

    model: SceneModel
    block: Block
    states: Sequence[str] = ()
    pairs: Sequence[Pair] = ()
    family: Family | None = None
    points: DesignParameters | None = None
    noisy: bool = False
    any_brightness: bool = False
    columns: Columns = field(default_factory=dict)
    by_case: dict[str, Float[Array, "cases designs"]] = field(default_factory=dict)
    walks: dict[tuple[int, DistanceKind], dict[Pair, Walk]] = field(default_factory=dict)

    @property
    def setup(self) -> Setup:
        """Scene and camera."""
        return self.model.setup

    @cached_property
    def size(self) -> int:
        """Number of designs."""
        return len(self.block)

    @cached_property
    def n_cases(self) -> int:
        """Sampling phases times field positions times moments of a pulse."""
        return int(self.model.n_cases * self.model.scales(self.exposure_s).shape[-1])

    @property
    def confused(self) -> Mapping[str, MemberNumbers]:
        """Signals of each state."""
        return {name: self.setup.members[name] for name in self.states}

    @cached_property
    def curves(self) -> DesignCurves:
        """QE of the modified channels."""
        return self.block.curves()

    def curves_of(self, design: int) -> Float[Array, "1 modified wavelengths"]:
        """Return the QE of one design."""
        if "curves" in self.__dict__:
            return self.curves[design : design + 1]
        return self.block.subset(slice(design, design + 1)).curves()

    def walked(
        self, kind: DistanceKind, wanted: Bool[BoolArray, " designs"]
    ) -> dict[Pair, Float[Array, "cases designs"]]:
        """Return the smallest distances of lamps of any brightness in each case, of `wanted` designs, by pair.

        Distances in DN and of states over the noise are found at once, since brightness curves are large.
        """
        kinds: list[DistanceKind] = [kind] if kind == "pixel" else ["DN"]
        if self.any_brightness and kind != "pixel":
            kinds.append("noise")
        for design in np.flatnonzero(wanted):
            if (int(design), kind) not in self.walks:
                self._walk(int(design), kinds)
        pairs = class_pairs(list(self.states)) if kind == "noise" else self.pairs
        columns = {pair: np.full((self.n_cases, self.size), np.nan) for pair in pairs}
        n_places = self.model.n_cases
        for design in np.flatnonzero(wanted):
            for pair, walk in self.walks[int(design), kind].items():
                of_places = walk.distances.reshape(n_places, -1).min(axis=1)
                columns[pair][:, design] = np.repeat(of_places, self.n_cases // n_places)
        return columns

    def _walk(self, design: int, kinds: Sequence[DistanceKind]) -> None:
        lamps = self._lamps(design)
        if "pixel" in kinds:
            roots = pixel_roots(self.setup.camera.mosaic)
            lamps = [of_case.times(roots) for of_case in lamps]
        curves = curves_of(lamps, self.setup)
        for kind in kinds:
            noise = kind == "noise"
            pairs = class_pairs(list(self.states)) if noise else self.pairs
            members = {pair: [self.setup.members[name] for name in pair] for pair in pairs if curves}
            self.walks[design, kind] = {
                pair: Walk.of(curves, self.model.n_cases, *both, noise=noise) for pair, both in members.items()
            }

    def _lamps(self, design: int) -> list[LampReadings]:
        """Return the lamps of a design over their brightness, in each case; none of one that is not finite."""
        curves = self.curves_of(design)
        if not (np.isfinite(curves).all() and np.isfinite(self.exposure_s[design])):
            return []
        return [*self.bright_model.lamps(curves)]

    def followed(self, model: SceneModel, design: int, kind: DistanceKind, walk: Walk) -> Float[Array, " cases"]:
        """Return the smallest distances of the pairs of a walk of a design in the cases of another model."""
        lamps = [*model.lamps(self.curves_of(design))]
        if kind == "pixel":
            lamps = [of_case.times(pixel_roots(self.setup.camera.mosaic)) for of_case in lamps]
        n_cases = sum(len(of_case.cases) for of_case in lamps)
        n_moments = n_cases // model.n_cases
        pairs = walk.at_moments if model.own_moments else [walk.at_any] * n_moments
        distances = np.empty(n_cases)
        for curves in curves_of(lamps, self.setup):
            of_cases = [pairs[case % n_moments] for case in curves.cases]
            distances[curves.cases] = curves.follow(of_cases, noise=kind == "noise")
        return distances

    def of(self, model: SceneModel, design: int) -> Batch:
        """Return one of the designs in another model of the scene."""
        block = CurveBlock(self.curves_of(design))
        return Batch(model, block, self.states, self.pairs, noisy=self.noisy)

    @property
    def finite(self) -> list[int]:
        """Designs whose curves and exposures are numbers."""
        known = np.flatnonzero(np.isfinite(self.exposure_s)).tolist()
        return [design for design in known if np.isfinite(self.curves_of(design)).all()]

    @cached_property
    def bright_model(self) -> SceneModel:
        """The model in which lamps of any brightness are read."""
        setup = self.setup.over_brightness
        return self.model if setup.left_out == self.setup.left_out else scene_model(setup)

    @cached_property
    def read_with_noise(self) -> NoisyReadout:
        """Readout with the variance of the noise."""
        return self.model.read_with_noise(self.curves)

    @cached_property
    def along(self) -> AlongReadings | None:
        """Readings of the designs that differ in one channel alone."""
        return None if self.noisy or self.size < MANY else self.model.along(self.block)

    @cached_property
    def exposure_s(self) -> PerDesign:
        """Exposure time of each design."""
        if self.along is not None and self.along.which.all():
            return np.full(self.size, self.along.of.exposure_s)
        return self.model.exposure_s(self.curves)

    def readings(self) -> Iterator[tuple[np.ndarray, slice, CaseReadings]]:
        """Yield designs, cases, and their readings, cases first."""
        along = self.along
        if along is not None:
            designs = np.flatnonzero(along.which)
            for start in range(0, designs.size, _AT_ONCE):
                part = slice(start, start + _AT_ONCE)
                values, dark = along.make(part), along.unlit(part)
                for case, fixed in enumerate(along.of.fixed):
                    of_case = self.setup, self.pairs, dark[:, case], None, fixed, along.of.channel, values[:, case]
                    yield designs[part], slice(case, case + 1), CaseReadings(*of_case)
        rest = np.arange(self.size) if along is None else np.flatnonzero(~along.which)
        if rest.size:
            curves = self.curves if along is None else self.block.subset(rest).curves()
            response = self.read_with_noise.mean if self.noisy else self.model.read(curves)[0]
            yield from self._whole_readings(rest, curves, response)

    def _whole_readings(
        self, designs: np.ndarray, curves: DesignCurves, response: DesignCases
    ) -> Iterator[tuple[np.ndarray, slice, CaseReadings]]:
        exposure_s = self.model.exposure_s(curves)
        n_cases, n_signals, n_channels = response.shape[1:]
        step = max(1, _READ_AT_ONCE // (n_cases * n_signals * n_channels))
        for start in range(0, designs.size, step):
            part = slice(start, start + step)
            dark = self.model.unlit(curves[part], exposure_s[part])
            n = len(dark)
            for first in range(0, n_cases, max(1, _AT_ONCE // n)):
                cases = slice(first, min(first + max(1, _AT_ONCE // n), n_cases))
                dn, unlit = (np.swapaxes(values[:, cases], 0, 1) for values in (response[part], dark))
                flat = dn.reshape(-1, n_signals, n_channels), unlit.reshape(-1, n_channels)
                yield designs[part], cases, CaseReadings(self.setup, self.pairs, flat[1], flat[0])
