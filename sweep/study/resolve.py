"""From the schema to frozen objects that a run can work on; everything is checked here, before any work."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

from ..base.errors import Fault, StudyError, SweepError, faults_of
from ..camera.mosaic import Mosaic
from ..designs.space import Space
from ..features import parts
from ..metrics.quantity import RequestedQuantities
from ..metrics.registry import quantities_of
from ..metrics.user_metrics import UserMetric
from . import checks
from .goals import brightness_note, check_goals, check_searched, search_of, with_pairs_in_order
from .lights import check_luminances, check_range, lights_of, with_light_files, with_population
from .model import Search, Study, requested_quantities
from .schema import CfaSection, StudySection
from .sensors import check_lenses, check_uncertainty, sensor_of, with_chief_rays, with_technologies
from .sources import Sources
from .spaces import SpaceBuilder, check_cfas, with_listed_designs
from .user_code import check_names, try_effects, try_metrics, user_effects, user_metrics

_Made = TypeVar("_Made")


def resolve(section: StudySection, sources: Sources) -> Study:
    """Construct the study that validated keys describe.

    Raises StudyError: with every issue so far, if the study cannot be used.
    """

    def attempt(make: Callable[[], _Made]) -> _Made | None:
        """Return the result, or None where it is refused; its issues are in `sources`."""
        try:
            return make()
        except StudyError:
            return None

    lit = attempt(lambda: with_light_files(section, sources))
    section = with_listed_designs(with_chief_rays(lit or section, sources), sources)
    sensor = attempt(lambda: sensor_of(section.sensor, sources))
    lights = attempt(lambda: lights_of(section.lights, sources)) if lit else None
    mosaics = {
        name: mosaic for name, cfa in section.cfas.items() if (mosaic := _mosaic(name, cfa, sources)) is not None
    }
    if sensor is not None:
        sensor = with_technologies(sensor, section, sources)
    if lights is not None:
        lights = with_population(lights, section, sources)
    spaces, colorants, before = list[Space](), None, len(sources.issues)
    made = {name: of.made(section, sources) for name, of in parts("section").items() if hasattr(of, "made")}
    features, are_known = {name: of for name, of in made.items() if of is not None}, len(sources.issues) == before
    metrics = attempt(lambda: user_metrics(section, sources))
    effects = attempt(lambda: user_effects(section, sources))
    sources.refuse(*check_cfas(section))
    if sensor is not None:
        colorants = None if section.colorants is None else sources.colorants(section.colorants)
        spaces = SpaceBuilder(section, sources, sensor, mosaics, colorants).spaces()
        sources.refuse(*check_lenses(section, sensor, spaces), *check_uncertainty(section, sensor, spaces))
        if section.uncertainty is not None and section.uncertainty.ir_cut_nm and sensor.ir_cut is None:
            note = f"{sensor.name}: no IR cut is known apart, and `uncertainty.ir_cut_nm` has no effect"
            sources.warnings.append(note)
    sources.refuse(*checks.check_scenes(section, mosaics))
    search = search_of(section, spaces, sources)
    if lights is not None:
        requested = requested_quantities(section, lights, features, metrics or ())
        section = with_pairs_in_order(section, requested)
        sources.refuse(*checks.check_lights(section, lights, requested), *check_luminances(section, lights))
        sources.refuse(
            *checks.check_features(checks.Checked(section, lights, mosaics, search, sensor, spaces, features))
        )
        if metrics is not None and are_known:
            sources.refuse(*_goal_faults(section, metrics, requested, spaces, search, sources))
    if sources.partial is not None or sources.issues or sensor is None or lights is None:
        raise sources.error
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
        digests=dict(sources.digests),
        inputs=sources.inputs,
        warnings=tuple(sources.warnings),
        features=features,
        user_metrics=metrics or (),
        user_effects=effects or (),
        colorants=colorants,
    )
    for check in (checks.check_size, try_effects, try_metrics, check_range, checks.check_count):
        sources.refuse(*check(study))
        if sources.issues:
            raise sources.error
    return study


def _goal_faults(
    section: StudySection,
    metrics: Sequence[UserMetric],
    requested: RequestedQuantities,
    spaces: Sequence[Space],
    search: Search | None,
    sources: Sources,
) -> list[Fault]:
    """Return what is wrong with objective and constraints; those of metrics with doubtful names are not looked at."""
    if named := [*check_names(metrics, requested, spaces)]:
        return named
    sources.warnings += brightness_note(section.objective.weights, section.scenarios.values(), requested)
    written_out = isinstance(sources.document.data.get("objective"), dict)
    faults = [*check_goals(section, requested, written_out=written_out)]
    if search is not None:
        faults += check_searched(section, search.space, quantities_of(requested))
    return faults


def _mosaic(name: str, cfa: CfaSection, sources: Sources) -> Mosaic | None:
    try:
        return cfa.mosaic(name)
    except SweepError as error:
        sources.refuse(*faults_of(("cfas", name), error))
        return None
