"""The tasks of a study on its wavelength grid; what cannot be judged adds a fault."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from ..base.types import FloatArray
from ..camera.pixel import Pixel, irradiance_factor
from ..camera.scene import Scene
from ..camera.sensor import SensorCurves
from ..curves.builtin.surrogate import BUILT_IN_RANGE_NM
from ..curves.builtin.task_sets import shipped
from ..curves.tasks import SHIPPED, Conditions, GriddedTask, StudyTasks
from ..designs.space import Space
from .schema import StudySection
from .schema_tasks import TasksSection
from .sources import Sources
from .task_files import OwnTasks

_AT = ("tasks",)


def tasks_of(asked: TasksSection, sources: Sources) -> StudyTasks | None:
    """The tasks of a study, or None after adding faults."""
    before, grid = len(sources.faults), sources.grid
    low, high = BUILT_IN_RANGE_NM
    if _shipped_spectra(asked) and not low <= grid.start_nm < grid.stop_nm <= high:
        asked_nm = f"{grid.start_nm:g} to {grid.stop_nm:g} nm"
        sources.add(
            ("wavelengths",), "the spectra of the tasks end before the grid", asked_nm, f"{low:g} to {high:g} nm"
        )
    for name in asked.shipped:
        if name not in SHIPPED:
            sources.unknown((*_AT, "shipped"), "task", name, list(SHIPPED))
    if len(sources.faults) > before:
        return None
    own = OwnTasks(sources)
    made = [own.task(name, task, (*_AT, "own", name)) for name, task in asked.own.items()]
    if len(sources.faults) > before:
        return None
    conditions = Conditions(asked.exposure_s, asked.read_noise_e, asked.illuminance_lx)
    found = (*(shipped(grid, name) for name in asked.shipped), *(task for task in made if task is not None))
    return StudyTasks(conditions, found, own.from_files)


def _shipped_spectra(asked: TasksSection) -> bool:
    """Whether any spectrum of the package is needed: all that the study has may be lamps from files."""
    named = (each for task in asked.own.values() for spectra in task.classes.values() for each in spectra)
    return (
        bool(asked.shipped) or any(task.under for task in asked.own.values()) or any(isinstance(e, str) for e in named)
    )


def check_seen(
    tasks: StudyTasks, section: StudySection, sensor: SensorCurves, spaces: Sequence[Space], sources: Sources
) -> None:
    """Filters stand still, and no patch fills a pixel's well: tasks are judged on axis, and nothing is clipped."""
    filters = [space.filter.technology for space in spaces if space.filter is not None]
    if any(t is not None and t.interference is not None for t in (*filters, *sensor.technologies.values())):
        sources.add(
            _AT, "tasks see filters that do not move with the angle of the light", None, "no interference filter"
        )
    for name, scenario in section.scenarios.items():
        electrons = max(_most_electrons(tasks, scenario, section.pixel, sensor, section.wavelengths.step_nm))
        most = min(section.pixel.well_e, section.pixel.full_scale_dn / section.pixel.dn_per_e)
        if electrons > most:
            told = f"{electrons:.3g} electrons in scenario {name}"
            sources.add((*_AT, "exposure_s"), "a patch of a task fills the well", told, f"at most {most:.3g}")


def _most_electrons(
    tasks: StudyTasks, scenario: Scene, pixel: Pixel, sensor: SensorCurves, step_nm: float
) -> Iterator[float]:
    """Electrons of the brightest patch of each task behind the sensor's brightest curve."""
    factor = irradiance_factor(scenario.optics) * pixel.area_m2 * step_nm * tasks.conditions.exposure_s
    brightest: FloatArray = np.max(list(sensor.qe.values()), axis=0)
    for photons in _spectra(tasks.tasks, scenario.photon_radiance, tasks.conditions.illuminance_lx):
        yield float((photons @ brightest).max()) * factor


def _spectra(tasks: Iterable[GriddedTask], photon_radiance: float, illuminance_lx: float) -> Iterator[FloatArray]:
    for task in tasks:
        if task.photons is not None:
            yield task.photons * photon_radiance
        if task.chart is not None:
            yield task.chart.photons * illuminance_lx
