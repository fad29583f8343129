"""From the schema to frozen objects that a runner can work on; everything is checked here, before any work."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from ..base.errors import StudyError, SweepError
from ..camera import psf
from ..camera.memory import too_large
from ..camera.mosaic import Mosaic
from ..camera.scene import OBJECT_RESOLUTION
from ..camera.sensor import BUILT_IN_SENSORS, SensorCurves
from ..curves.builtin.registry import BUILT_IN_LIGHTS
from ..curves.lights import Lights
from ..curves.spectrum import Curves
from ..curves.tasks import StudyTasks
from ..designs.space import Space
from ..metrics.own import OwnMetric
from ..metrics.quantity import Asked, Quantity
from ..metrics.registry import listed, quantities_of
from .checked import Checked
from .document import Document
from .goals import check_goals, check_searched, search_of
from .light_checks import check_luminances, check_range, check_regions, with_population
from .light_files import with_light_files
from .model import Search, Study, asked_of
from .own_codes import offered_curves
from .own_models import check_names, own_effects, own_metrics, try_effects, try_metrics
from .schema import CfaSection, StudySection
from .schema_curves import LightsSection
from .seen_images import check_vision
from .sensors import check_lenses, sensor_of, with_chief_rays, with_technologies
from .sources import KeptSources, Sources
from .spaces import SpaceBuilder, check_cfas

_Made = TypeVar("_Made")
_MOST_DESIGNS = 10**9


class _Resolver:
    """Turns a checked schema into a Study, collecting every fault that it finds."""

    def __init__(
        self,
        document: Document,
        section: StudySection,
        folders: list[Path],
        kept: KeptSources | None,
        given: Mapping[str, Curves],
        allow_code: bool | Mapping[str, str],
    ) -> None:
        self.sources = Sources(document, section.wavelengths, folders, kept, given, allow_code)
        self.section = section
        self.faults = self.sources.faults
        self.add = self.sources.add
        self.unknown = self.sources.unknown
        self.tasks: StudyTasks | None = None
        self.own: tuple[OwnMetric, ...] = ()

    def resolve(self, known: Checked) -> Study:
        """The study. Raises StudyError once all is checked that can be without what is wrong. `known`: its schema."""
        lit = self.had(lambda: with_light_files(self.section, self.sources))
        section = self.section = with_chief_rays(lit or self.section, self.sources)
        sensor = self.had(self.sensor)
        lights = self.had(lambda: self.sources.lights(self.offered(section.lights))) if lit else None
        mosaics = {name: mosaic for name, cfa in section.cfas.items() if (mosaic := self.mosaic(name, cfa)) is not None}
        if sensor is not None:
            sensor = with_technologies(sensor, section, self.sources)
        held_out = self.had(lambda: self.held_out(lights))
        if lights is not None:
            lights = with_population(lights, section, self.sources)
        self.read_tasks()
        metrics = self.had(lambda: own_metrics(section, self.sources))
        self.own = metrics or ()
        effects = self.had(lambda: own_effects(section, self.sources))
        spaces = self.spaces(sensor, mosaics)
        check_regions(section, self.sources)
        self.check_images()
        search = search_of(section, spaces, self.sources)
        if lights is not None:
            self.check_lights(lights, mosaics)
            if metrics is not None and (self.tasks is not None or section.tasks is None):
                self.had(lambda: self.check_quantities(lights, spaces, search))
        if self.faults or known.faults or sensor is None or lights is None:
            raise StudyError(known.faults_with(self.faults))
        study = Study(
            name=section.study,
            section=section,
            grid=section.wavelengths,
            sensor=sensor,
            lights=lights,
            pixel=section.pixel,
            scenarios=section.scenarios,
            geometry=section.geometry,
            mosaics=mosaics,
            spaces=tuple(spaces),
            objective=section.objective,
            constraints=section.constraints,
            search=search,
            digests=dict(self.sources.digests),
            warnings=tuple(self.sources.warnings),
            held_out=held_out,
            tasks=self.tasks,
            own=self.own,
            own_effects=effects or (),
        )
        _check_memory(study, self.sources)
        try_effects(study, self.sources)
        try_metrics(study, self.sources)
        check_range(study, self.sources)
        if self.faults:
            raise StudyError(self.faults)
        _check_count(study, self.sources)
        return study

    def had(self, make: Callable[[], _Made]) -> _Made | None:
        """The result, or None where that is refused, after its faults were added."""
        before = len(self.faults)
        try:
            return make()
        except StudyError as error:
            self.faults.extend(error.faults if len(self.faults) == before else ())
            return None

    def spaces(self, sensor: SensorCurves | None, mosaics: Mapping[str, Mosaic]) -> list[Space]:
        """The spaces of the study; none without a sensor."""
        if sensor is None:
            check_cfas(self.section, self.sources)
            return []
        spaces = SpaceBuilder(self.section, self.sources, sensor, mosaics).spaces()
        check_lenses(self.section, sensor, spaces, self.sources)
        if self.tasks is not None:
            from .tasks import check_seen  # noqa: PLC0415  (few studies have tasks)

            check_seen(self.tasks, self.section, sensor, spaces, self.sources)
        return spaces

    def check_lights(self, lights: Lights, mosaics: Mapping[str, Mosaic]) -> None:
        """Check all that names signal types or needs their spectra."""
        self.check_columns(lights)
        check_luminances(self.section, lights, self.sources)
        self.check_recognition(lights)
        check_vision(self.section, lights, mosaics, self.sources)
        self.check_published(lights, mosaics)

    def check_quantities(self, lights: Lights, spaces: list[Space], search: Search | None) -> None:
        """Check all that names quantities. Raises StudyError where a name has two meanings."""
        check_names(self.own, self.asked(lights), spaces, self.sources)
        check_goals(self.section, self.sources, self.asked(lights))
        if search is not None:
            check_searched(self.section, search.space, quantities_of(self.asked(lights)), self.sources)

    def sensor(self) -> SensorCurves | None:
        """Its curves, of an installed package where that offers it."""
        section, known = self.section.sensor, BUILT_IN_SENSORS
        return sensor_of(self.sources, offered_curves(self.sources, ("sensor",), section, "sweep.sensors", known))

    def offered(self, lights: LightsSection, at: tuple[str, ...] = ("lights",)) -> LightsSection:
        """Lights, of an installed package where that offers them."""
        return offered_curves(self.sources, at, lights, "sweep.lights", BUILT_IN_LIGHTS)

    def held_out(self, lights: Lights | None) -> Lights | None:
        """Lights to validate on; leaving one out needs a search."""
        asked = self.section.validation
        if asked is not None and asked.leave_one_out and self.section.search is None:
            self.add(("validate", "leave_one_out"), "nothing is searched", None, "a study with `search`")
        if asked is None or asked.lights is None or lights is None:
            return None
        return self.sources.held_out(self.offered(asked.lights, ("validate", "lights")), lights)

    def read_tasks(self) -> None:
        """The study's tasks, where it has some."""
        if self.section.tasks is not None:
            from .tasks import tasks_of  # noqa: PLC0415  (few studies have tasks)

            self.tasks = tasks_of(self.section.tasks, self.sources)

    def asked(self, lights: Lights) -> Asked:
        """Quantities that an objective or a constraint can name."""
        return asked_of(self.section, lights, self.tasks, self.own)

    def check_columns(self, lights: Lights) -> None:
        """Every pair of signal types has columns of its own."""
        seen: dict[str, Quantity] = {}
        for quantity in listed(replace(self.asked(lights), edge_shift=False)):
            other = seen.setdefault(quantity.name, quantity)
            if other.pair != quantity.pair and other.pair is not None and quantity.pair is not None:
                pairs = f"{'/'.join(other.pair)} and {'/'.join(quantity.pair)}"
                problem = f"the pairs {pairs} share the column {quantity.name}"
                self.add(("lights",), problem, None, "other names of signal types")

    def check_images(self) -> None:
        """Every target makes an image that can be computed."""
        for name, scenario in self.section.scenarios.items():
            refused = psf.too_much(scenario, self.section.pixel)
            if refused is not None:
                key, problem, value, allowed = refused
                self.add(("scenarios", name, *key), problem, value, allowed)

    def check_recognition(self, lights: Lights) -> None:
        """Its states are signal types, each once, and every scenario has noise."""
        asked = self.section.recognition
        if asked is None:
            return
        for name in asked.states or ():
            if name not in lights.classes:
                self.unknown(("recognition", "states"), "signal type", name, list(lights.classes))
        if asked.states is not None and len(set(asked.states)) < len(asked.states):
            self.add(("recognition", "states"), "a signal type is named twice", asked.states)
        if len(lights.classes) < 2:
            self.add(("recognition",), "there is one signal type only", lights.classes[0], "two or more")
        for name, scenario in self.section.scenarios.items():
            if scenario.noise is None:
                problem = "`recognition` needs noise in every scenario"
                self.add(("scenarios", name, "noise"), problem, None, "noise: true")

    def mosaic(self, name: str, cfa: CfaSection) -> Mosaic | None:
        try:
            return Mosaic.from_name(name) if cfa.tile is None else Mosaic.from_rows(name, cfa.tile)
        except SweepError as error:
            for fault in error.faults:
                self.add(("cfas", name), fault.problem, fault.value, fault.allowed)
            return None

    def check_published(self, lights: Lights, mosaics: Mapping[str, Mosaic]) -> None:
        section = self.section
        nominal = quantities_of(Asked(lights.classes)).values()
        columns = [q.name for q in nominal if q.ends and q.needs != "family"]
        known = dict.fromkeys([*mosaics, *section.designs, *section.geometry])
        for table, rows in section.published.items():
            for row, values in rows.items():
                path = ("published", table, row)
                if row not in known:
                    self.unknown(path, "CFA, design or geometry", row, list(known))
                for quantity in values:
                    names = [OBJECT_RESOLUTION] if row in section.geometry else columns
                    if row in known and quantity not in names:
                        self.unknown((*path, quantity), "quantity", quantity, names)


def _check_memory(study: Study, sources: Sources) -> None:
    """The kernels of every scene and CFA fit into memory. Raises StudyError."""
    for name in study.scenarios:
        for space in study.spaces:
            if (refused := too_large(study.setup(space, name))) is not None:
                problem, value, allowed = refused
                sources.add(("scenarios", name, "target"), f"{problem} (CFA {space.cfa})", value, allowed)
                raise StudyError(sources.faults)


def _check_count(study: Study, sources: Sources) -> None:
    """There are designs, and not too many. Raises StudyError."""
    if not study.n_designs and study.search is None:
        sources.add(("cfas",), "no designs", None, "a CFA with a curve for each channel, a design, a sweep or a search")
        raise StudyError(sources.faults)
    if study.n_designs > _MOST_DESIGNS:
        sources.add(("sweeps",), "too many designs", f"{study.n_designs:,}", f"at most {_MOST_DESIGNS:,}")
        raise StudyError(sources.faults)


def resolve(
    document: Document,
    known: Checked,
    folders: list[Path],
    kept: KeptSources | None = None,
    given: Mapping[str, Curves] = {},
    *,
    allow_code: bool | Mapping[str, str] = False,
) -> Study:
    """Make the study; `folders` are searched in order for its files. Raises StudyError with every fault found.

    `known`: what its schema says; `kept`: curves to take instead of those in files, `given`: files that are not on a
    disk; `allow_code`: code that it names may run. See `Sources`.
    """
    return _Resolver(document, known.section, folders, kept, given, allow_code).resolve(known)
