"""A study as frozen objects, ready to run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..base.errors import StudyError, ValidationIssue
from ..camera.camera import Camera
from ..camera.curve_errors import UncertainCurves
from ..camera.effects import Box
from ..camera.mosaic import Mosaic
from ..camera.pixel import Pixel
from ..camera.plan import Plan, plan_scene
from ..camera.scene import Geometry, Scene
from ..camera.sensor import SensorCurves
from ..camera.setup import Feature, Setup
from ..camera.user_effects import UserEffect
from ..designs.space import Space
from ..designs.technology import Technology
from ..designs.tolerance import Tolerance
from ..features import parts
from ..metrics.bound import Bound
from ..metrics.objective import Objective, columns_of
from ..metrics.quantity import DN, UPPER_BOUND, Column, Quantity, RequestedQuantities, asked_of
from ..metrics.separation import csd_name
from ..metrics.user_metrics import UserMetric
from ..search.problem import Problem
from ..spectra.colorants import Colorants
from ..spectra.lights import Lights, Pair, class_pairs, in_order
from ..spectra.spectrum import WavelengthGrid
from .inputs import Input
from .schema import StudySection


@dataclass(frozen=True)
class Search:
    """A search inside the box of a sweep.

    Its objective counts in `scenario`, or with its worst value over all `scenarios` of a series. `tiles`: spaces of
    which the best one is searched, of which `space` is the first; its levels are then those of the CFA sensitivity.
    """

    name: str
    space: Space
    scenario: str
    scenarios: tuple[str, ...]
    algorithm: str
    starts: int
    max_evaluations: int
    levels: tuple[float, ...] = ()
    tiles: tuple[Space, ...] = ()

    @property
    def searched(self) -> tuple[Space, ...]:
        """All spaces of which a filter may be the answer."""
        return self.tiles or (self.space,)


@dataclass(frozen=True)
class Study:
    """A whole study, checked and ready to run."""

    name: str
    section: StudySection
    grid: WavelengthGrid
    sensor: SensorCurves
    lights: Lights
    pixel: Pixel
    scenarios: Mapping[str, Scene]
    geometry: Mapping[str, Geometry]
    mosaics: Mapping[str, Mosaic]
    spaces: tuple[Space, ...]
    objective: Objective
    constraints: Mapping[str, Bound]
    search: Search | None
    digests: Mapping[str, str]
    warnings: tuple[str, ...]
    features: Mapping[str, Feature] = field(default_factory=dict)
    user_metrics: tuple[UserMetric, ...] = ()
    user_effects: tuple[UserEffect, ...] = ()
    colorants: Colorants | None = None
    plans: Mapping[str, Plan] = field(default_factory=dict)
    inputs: Mapping[str, Input] = field(default_factory=dict)
    _setups: dict[tuple[Any, ...], Setup] = field(init=False, repr=False, compare=False, default_factory=dict)

    def __getstate__(self) -> dict[str, Any]:
        """Return what a worker is given: it makes setups of its own."""
        return self.__dict__ | {"_setups": {}, "inputs": {}}

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """Pairs of signal types, in order."""
        return class_pairs(self.lights.classes)

    @property
    def tolerance(self) -> Tolerance:
        """Production tolerance of filters."""
        return self.section.production.tolerance

    @property
    def quantities(self) -> Mapping[str, Quantity]:
        """Quantities of the result table: those of a design, worst cases, a combined objective."""
        return columns_of(self.requested, self.objective)

    @property
    def requested(self) -> RequestedQuantities:
        """Quantities that the study asks for of its designs."""
        quantities = requested_quantities(self.section, self.lights, self.features, self.user_metrics)
        return replace(quantities, any_place=self.any_place, brightest=self.sensor.brightest)

    @property
    def states(self) -> tuple[str, ...]:
        """Signal types that noise may confuse; none where the study does not ask."""
        return _states(self.section, self.lights)

    @property
    def any_place(self) -> bool:
        """Return whether a scenario asks for the worst sampling phase."""
        targets = [scenario.target for scenario in self.scenarios.values()]
        return any(target is not None and target.phase_px == "any" for target in targets)

    @property
    def trade_off(self) -> tuple[str, str]:
        """The two quantities of the Pareto front: separation and sensitivity.

        The front is that of the designs that meet every constraint but those on these two.

        The separation is the objective, or, where that is a sensitivity, the first CSD that is constrained.
        """
        column, known = self.objective.column, self.quantities
        if known[column].role != "light":
            return column, "sensitivity"
        constrained = [name for name in self.constraints if known[name].distance_kind in (DN, "chromatic")]
        return (constrained or [csd_name(self.pairs[0])])[0], column

    @property
    def parameters(self) -> tuple[str, ...]:
        """Parameters of all families of the study, each once."""
        return tuple(dict.fromkeys(name for space in self.spaces for name in space.parameters))

    @property
    def columns(self) -> Mapping[str, Column]:
        """Columns of the result tables in words: parameters, quantities, and the bound of the search's answer."""
        filters = [space.filter for space in self.spaces if space.filter is not None]
        parameters = {
            one.name: Column(one.name, "parameter", one.meaning, one.unit)
            for filter_ in filters
            for one in filter_.family.parameters
        }
        unit = self.quantities[self.objective.column].unit
        return {**parameters, **self.quantities, UPPER_BOUND: Column(UPPER_BOUND, "search", "", unit)}

    @property
    def n_filters(self) -> int:
        """Filters of all spaces, plain CFAs included, each counted once over all scenarios."""
        return sum(space.size for space in self.spaces)

    @property
    def n_designs(self) -> int:
        """Designs of all spaces, over all scenarios."""
        return self.n_filters * len(self.scenarios)

    def setup(self, space: Space, scenario: str) -> Setup:
        """Return the setup shared by the designs of a space."""
        bases = {} if space.filter is None else space.filter.bases
        technology = None if space.filter is None else space.filter.technology
        return self.setup_of(space.cfa, scenario, bases, technology, swept=space.kind == "sweep")

    @property
    def swept(self) -> Mapping[str, frozenset[str]]:
        """Features that are computed for swept designs, too, with the columns that are asked of them."""
        hooks: dict[str, Callable[[Study], frozenset[str] | None]] = {
            name: getattr(module, "swept", lambda _: frozenset()) for name, module in parts("section").items()
        }
        columns = {name: hooks[name](self) for name in self.features}
        return {name: of for name, of in columns.items() if of is not None}

    def setup_of(
        self,
        cfa: str,
        scenario: str,
        bases: Mapping[str, str],
        technology: Technology | None = None,
        *,
        swept: bool = False,
    ) -> Setup:
        """Return the setup of a CFA, the same one each time, which owns its model.

        `bases`: modified channel -> curve that it replaces.
        """
        key = cfa, scenario, *bases.items(), technology, swept
        if key not in self._setups:
            self._setups[key] = self._setup(cfa, scenario, bases, technology, swept=swept)
        return self._setups[key]

    def _setup(
        self,
        cfa: str,
        scenario: str,
        bases: Mapping[str, str],
        technology: Technology | None,
        *,
        swept: bool,
    ) -> Setup:
        mosaic, scene = self.mosaics[cfa], self.scenarios[scenario]
        replaced = {**self.section.cfas[cfa].curves, **bases}
        modified = tuple(mosaic.channels.index(channel) for channel in bases)
        names, errors = self.sensor.mosaic_curves(mosaic, replaced), self.section.uncertainty
        technologies = [self.sensor.technologies.get(name) for name in names]
        for channel in modified:
            technologies[channel] = technology
        camera = Camera(
            grid=self.grid,
            mosaic=mosaic,
            qe=self.sensor.mosaic_qe(mosaic, replaced),
            modified=modified,
            clear_qe=self.sensor.curve(self.sensor.clear),
            pixel=self.pixel_in(scene),
            technologies=tuple(technologies) if any(technologies) else (),
            uncertain=None if errors is None else UncertainCurves(self.sensor, tuple(names), errors),
        )
        return Setup(
            camera,
            self.lights,
            scene,
            features={name: of for name, of in self.features.items() if not swept or name in self.swept},
            accuracy=self.section.accuracy,
            user_effects=self.user_effects,
            left_out=self.plans[scenario].left_out if scenario in self.plans else frozenset(),
        )

    def pixel_in(self, scene: Scene) -> Pixel:
        """Return the study's pixel with the numbers and the noise of a scene."""
        return scene.pixel_of(self.pixel)

    def box(self, space: Space, scenario: str) -> Box:
        """Return the parameter range of a space, for a plan of the scenario."""
        setup = self.setup(space, scenario).with_all_effects
        low, high = setup.camera.qe.copy(), setup.camera.qe.copy()
        if space.filter is not None:
            ends = [np.array([end(axis) for axis in space.axes], dtype=float) for end in (min, max)]
            families = [space.filter.family.perturbed(production_error) for production_error in self.tolerance.places]
            lows, highs = zip(*(family.hull(*ends) for family in families), strict=True)
            low[list(setup.camera.modified)] = np.min(lows, axis=0)
            high[list(setup.camera.modified)] = np.max(highs, axis=0)
        return Box(setup, low, high)

    def plan(self, scenario: str, tolerance_dn: float | None = None) -> Plan:
        """Plan which effects a scene is simulated with.

        `tolerance_dn`: tolerance in DN; that of the study by default. Raises StudyError if numbers that are valid one
        by one overflow together.
        """
        tolerance_dn = self.section.tolerance_dn if tolerance_dn is None else tolerance_dn
        searched = () if self.search is None or scenario not in self.search.scenarios else self.search.searched
        spaces = [space for space in self.spaces if space.size or space in searched] or list(self.spaces)
        try:
            boxes = [self.box(space, scenario) for space in spaces]
            return plan_scene(scenario, boxes, tolerance_dn, self.section.accuracy, for_noise=bool(self.states))
        except ArithmeticError:
            problem = "the numbers of this scene, or of the pixel, are too large or too small to compute with"
            raise StudyError(ValidationIssue(problem, key=f"scenarios.{scenario}")) from None

    def with_plans(self, tolerance_dn: float | None = None) -> Study:
        """Plan all scenarios.

        `tolerance_dn`: tolerance in DN; that of the study by default. Raises StudyError as `plan`.
        """
        return replace(self, plans={name: self.plan(name, tolerance_dn) for name in self.scenarios})

    def problem(self, search: Search) -> Problem:
        """Formulate the search as an optimization problem."""
        assert search.space.filter is not None
        return Problem(
            setup=self.setup(search.space, search.scenario),
            family=search.space.filter.family,
            low=np.array([min(axis) for axis in search.space.axes], dtype=float),
            high=np.array([max(axis) for axis in search.space.axes], dtype=float),
            objective=self.objective,
            constraints=self.constraints,
            tolerance=self.tolerance,
            states=self.states,
            user_metrics=self.user_metrics,
            seed=self.section.seed,
            others=tuple((self.setup(search.space, name), search.space.filter.family) for name in search.scenarios[1:]),
        )


def requested_quantities(
    section: StudySection, lights: Lights, features: Mapping[str, Feature], user_metrics: tuple[UserMetric, ...]
) -> RequestedQuantities:
    """Return the quantities that a study computes, as far as its lights and features determine them."""
    return RequestedQuantities(
        lights.classes,
        _states(section, lights),
        edge_shift=bool(section.production.tolerance),
        population=section.population is not None,
        wanted_yield=section.wanted_yield,
        features=asked_of(features),
        user_metrics=user_metrics,
    )


def _states(section: StudySection, lights: Lights) -> tuple[str, ...]:
    recognition = section.recognition
    return () if recognition is None else tuple(in_order(recognition.states or lights.classes))
