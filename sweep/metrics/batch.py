"""A batch of designs in a scene: what metrics ask for, each computed once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

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
from ..camera.brightness import LampReadings
from ..camera.model import Changing, SceneModel, scene_model
from ..camera.readout import NoisyReadout
from ..camera.setup import Setup
from ..designs.block import Block
from ..designs.family import Family
from ..spectra.lights import Pair, class_pairs
from ..vision.section import SeededVision
from .brightness import chromatic_distance, curves_of
from .quantity import Columns
from .separation import pixel_roots

_AT_ONCE = 1024
"""Designs that differ in one channel alone, or readouts of a design in a case, that are looked at at once."""
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
    of any brightness, too; `columns`: those that are known.
    """

    model: SceneModel
    block: Block
    states: Sequence[str] = ()
    pairs: Sequence[Pair] = ()
    probabilities: bool = False
    family: Family | None = None
    points: DesignParameters | None = None
    images: SeededVision | None = None
    noisy: bool = False
    any_brightness: bool = False
    columns: Columns = field(default_factory=dict)
    _over_brightness: tuple[dict[Pair, PerDesign], dict[Pair, PerDesign]] | None = None

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

    def over_brightness(
        self, wanted: Bool[BoolArray, " designs"] | None = None
    ) -> tuple[dict[Pair, PerDesign], dict[Pair, PerDesign]]:
        """Return the smallest distances of lamps of any brightness: of `wanted` designs, DN, and of states over noise.

        Both at the first call, design by design, since brightness curves are large.
        """
        if self._over_brightness is None:
            wanted = np.zeros(self.size, dtype=bool) if wanted is None else wanted
            states = class_pairs(list(self.states)) if self.any_brightness else []
            of_pairs, of_states = ({p: np.full(self.size, np.nan) for p in pairs} for pairs in (self.pairs, states))
            self._over_brightness = both = of_pairs, of_states
            for design in np.flatnonzero(wanted | bool(states)):
                cases = curves_of(self._lamps(int(design)), self.setup)
                for noise, distances in enumerate(both if cases else ()):
                    for a, b in distances if noise or wanted[design] else ():
                        members = self.setup.members[a], self.setup.members[b]
                        distances[a, b][design] = chromatic_distance(cases, *members, noise=bool(noise))
        return self._over_brightness

    def over_brightness_by_pixel(self, wanted: Bool[BoolArray, " designs"]) -> dict[Pair, PerDesign]:
        """Return distances of lamps of any brightness of `wanted` designs, with every pixel counted, DN."""
        roots, distances = pixel_roots(self.setup.camera.mosaic), {p: np.full(self.size, np.nan) for p in self.pairs}
        for design in np.flatnonzero(wanted):
            cases = curves_of([lamps.times(roots) for lamps in self._lamps(int(design))], self.setup)
            for (a, b), of_pair in distances.items() if cases else ():
                of_pair[design] = chromatic_distance(cases, self.setup.members[a], self.setup.members[b], noise=False)
        return distances

    def _lamps(self, design: int) -> list[LampReadings]:
        """Return the lamps of a design over their brightness, in each case; none of one that is not finite."""
        curves = self.curves_of(design)
        if not (np.isfinite(curves).all() and np.isfinite(self.exposure_s[design])):
            return []
        return [*scene_model(self.setup.over_brightness).lamps(curves)]

    @cached_property
    def read_with_noise(self) -> NoisyReadout:
        """Readout with the variance of the noise."""
        return self.model.read_with_noise(self.curves)

    @cached_property
    def changing(self) -> Changing | None:
        """Readings of the designs that differ in one channel alone."""
        return None if self.noisy else self.model.changing(self.block)

    @cached_property
    def exposure_s(self) -> PerDesign:
        """Exposure time of each design."""
        if self.changing is not None and self.changing.which.all():
            return np.full(self.size, self.changing.exposure_s)
        return self.model.exposure_s(self.curves)

    @cached_property
    def _response(self) -> DesignCases:
        """All channels of the designs that are not `changing`."""
        if self.noisy:
            return self.read_with_noise.mean
        return self.model.read(self._rest)[0]

    @cached_property
    def _rest(self) -> DesignCurves:
        if self.changing is None:
            return self.curves
        return self.block.subset(np.flatnonzero(~self.changing.which)).curves()

    def readings(self) -> Iterator[tuple[np.ndarray, slice, CaseReadings]]:
        """Yield designs, cases, and their readings, cases first."""
        changing = self.changing
        if changing is not None:
            designs = np.flatnonzero(changing.which)
            for start in range(0, designs.size, _AT_ONCE):
                part = slice(start, start + _AT_ONCE)
                values, dark = changing.make(part), changing.unlit(part)
                for case, fixed in enumerate(changing.fixed):
                    of_case = self.setup, self.pairs, dark[:, case], None, fixed, changing.channel, values[:, case]
                    yield designs[part], slice(case, case + 1), CaseReadings(*of_case)
        rest = np.arange(self.size) if changing is None else np.flatnonzero(~changing.which)
        if rest.size:
            yield from self._whole_readings(rest)

    def _whole_readings(self, designs: np.ndarray) -> Iterator[tuple[np.ndarray, slice, CaseReadings]]:
        response, exposure_s = self._response, self.model.exposure_s(self._rest)
        n_cases, n_signals, n_channels = response.shape[1:]
        step = max(1, _READ_AT_ONCE // (n_cases * n_signals * n_channels))
        for start in range(0, designs.size, step):
            part = slice(start, start + step)
            dark = self.model.unlit(self._rest[part], exposure_s[part])
            n = len(dark)
            for first in range(0, n_cases, max(1, _AT_ONCE // n)):
                cases = slice(first, min(first + max(1, _AT_ONCE // n), n_cases))
                dn, unlit = (np.swapaxes(values[:, cases], 0, 1) for values in (response[part], dark))
                flat = dn.reshape(-1, n_signals, n_channels), unlit.reshape(-1, n_channels)
                yield designs[part], cases, CaseReadings(self.setup, self.pairs, flat[1], flat[0])
