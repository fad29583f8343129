"""A study as frozen objects, ready to run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..constraints import Bound
from ..datasets.lights import Lights
from ..evaluate import Setup
from ..filters import SensorCurves
from ..metrics import Pair, class_pairs, csd_name
from ..mosaics import Mosaic
from ..problem import Problem
from ..scenes import Geometry, Scenario
from ..sensor import Pixel
from ..spaces import Space
from ..spectra import WavelengthGrid
from .schema import StudySection


@dataclass(frozen=True)
class Search:
    """A search inside the box of a sweep."""

    space: Space
    scenario: str
    algorithm: str
    starts: int
    max_evaluations: int
    levels: tuple[float, ...] = ()


@dataclass(frozen=True)
class Study:
    """A whole study, checked and ready to run."""

    name: str
    section: StudySection
    grid: WavelengthGrid
    sensor: SensorCurves
    lights: Lights
    pixel: Pixel
    scenarios: Mapping[str, Scenario]
    geometry: Mapping[str, Geometry]
    mosaics: Mapping[str, Mosaic]
    spaces: tuple[Space, ...]
    objective: Pair
    constraints: Mapping[str, Bound]
    search: Search | None
    digests: Mapping[str, str]
    warnings: tuple[str, ...]

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """Pairs of signal types, in order."""
        return class_pairs(self.lights.classes)

    @property
    def objective_column(self) -> str:
        """Column of the CSD that is maximized."""
        return csd_name(self.objective)

    @property
    def parameters(self) -> tuple[str, ...]:
        """Parameters of all families of the study, each once."""
        return tuple(dict.fromkeys(name for space in self.spaces for name in space.parameters))

    @property
    def n_designs(self) -> int:
        """Designs of all spaces, over all scenarios."""
        return sum(space.size for space in self.spaces) * len(self.scenarios)

    def setup(self, space: Space, scenario: str) -> Setup:
        """What the designs of `space` share in a scenario."""
        mosaic = self.mosaics[space.cfa]
        replaced = dict(self.section.cfas[space.cfa].curves)
        modified: tuple[int, ...] = ()
        if space.filter is not None:
            replaced |= dict.fromkeys(space.filter.channels, space.filter.base)
            modified = tuple(mosaic.channels.index(channel) for channel in space.filter.channels)
        return Setup(
            grid=self.grid,
            mosaic=mosaic,
            qe=self.sensor.mosaic_qe(mosaic, replaced),
            modified=modified,
            clear_qe=self.sensor.curve(self.sensor.clear),
            lights=self.lights,
            pixel=self.pixel,
            scenario=self.scenarios[scenario],
        )

    def problem(self, search: Search) -> Problem:
        """The search as a mathematical problem."""
        assert search.space.filter is not None
        return Problem(
            setup=self.setup(search.space, search.scenario),
            family=search.space.filter.family,
            low=np.array([min(axis) for axis in search.space.axes], dtype=float),
            high=np.array([max(axis) for axis in search.space.axes], dtype=float),
            pair=self.objective,
            constraints=self.constraints,
            pairs={csd_name(pair): pair for pair in self.pairs},
        )
