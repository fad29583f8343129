"""The tasks of a study on its wavelength grid: those of the package, and own ones from groups and files."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..base.types import FloatArray
from ..camera.pixel import Pixel, irradiance_factor
from ..camera.scene import Scene
from ..camera.sensor import SensorCurves
from ..curves.builtin.surrogate import BUILT_IN_RANGE_NM
from ..curves.builtin.task_sets import group, is_surface, separation_task, shipped, task_groups
from ..curves.files import is_curve_file
from ..curves.tasks import ILLUMINANTS, SHIPPED, Conditions, GriddedTask, StudyTasks
from ..designs.space import Space
from .schema import StudySection
from .schema_curves import TaskFile
from .schema_tasks import OwnTask, TasksSection
from .sources import Sources
from .yaml_tree import Key

_AT = ("tasks",)
_MOST_PAIRS = 200_000
_Place = tuple[Key, ...]


@dataclass
class OwnTasks:
    """Makes own tasks; `from_files`: what was read from files, see `StudyTasks`."""

    sources: Sources
    from_files: dict[tuple[str, str], FloatArray] = field(default_factory=dict)

    def task(self, name: str, asked: OwnTask, at: _Place) -> GriddedTask | None:
        """The task at a place of the study, or None after adding faults."""
        before = len(self.sources.faults)
        self._check(name, asked, at)
        if len(self.sources.faults) > before:
            return None
        classes: dict[str, FloatArray] = {}
        for kind, named in asked.classes.items():
            path = (*at, "classes", kind)
            spectra = [one for each in self._places(path, named) for one in self._spectra(f"{name} {kind}", *each)]
            classes[kind] = np.array(spectra).reshape(-1, self.sources.grid.size)
        if len(self.sources.faults) > before or not self._fits(at, classes):
            return None
        return separation_task(self.sources.grid, name, classes, asked.under)

    def _check(self, name: str, task: OwnTask, path: _Place) -> None:
        """Its groups and lights are known, and its classes are all lamps, or all surfaces."""
        sources, known = self.sources, task_groups()
        if name in SHIPPED:
            sources.add(path, "a task of the package has this name", name, "another name")
        kinds = set()
        for kind, named in task.classes.items():
            for each in named:
                if isinstance(each, TaskFile):
                    kinds.add(each.quantity == "reflectance")
                elif each in known:
                    kinds.add(is_surface(each))
                else:
                    self._unknown_group((*path, "classes", kind), each, list(known))
        for light in task.under:
            if light not in ILLUMINANTS:
                sources.unknown((*path, "under"), "light", light, list(ILLUMINANTS))
        if len(set(task.under)) < len(task.under):
            sources.add((*path, "under"), "a light is named twice", task.under)
        if len(kinds) > 1:
            sources.add((*path, "classes"), "a task is of lamps, or of surfaces", list(task.classes), "one of both")
        elif kinds == {True} and not task.under:
            sources.add((*path, "under"), "surfaces need light", None, ", ".join(ILLUMINANTS))
        elif kinds == {False} and task.under:
            sources.add((*path, "under"), "lamps are seen by their own light", task.under, "leave it out")

    def _unknown_group(self, path: _Place, name: str, known: list[str]) -> None:
        if is_curve_file(name):
            allowed = f"{{file: {name}, quantity: reflectance}}, or energy, or photons"
            self.sources.add(path, "what its numbers are is not told", name, allowed)
        else:
            self.sources.unknown(path, "group of spectra", name, known)

    def _places(self, path: _Place, named: list[str | TaskFile]) -> Iterator[tuple[_Place, str | TaskFile]]:
        """Each entry of a class with its place; no file is named twice."""
        files: set[str] = set()
        for index, each in enumerate(named):
            if isinstance(each, TaskFile) and each.file in files:
                self.sources.add((*path, index, "file"), "the class has this file already", each.file)
                continue
            if isinstance(each, TaskFile):
                files.add(each.file)
            yield (*path, index), each

    def _spectra(self, owner: str, path: _Place, each: str | TaskFile) -> list[FloatArray]:
        """Reflectances, or relative photons, ndarray[n_wavelengths] each; `owner`: task and class."""
        sources = self.sources
        if isinstance(each, str):
            return list(group(sources.grid, each))
        if sources.kept is not None:
            spectra = self._kept(owner, path, each, sources.kept.tasks)
        else:
            spectra = self._read(path, each)
        self.from_files |= {(owner, f"{each.file}:{column}"): values for column, values in spectra.items()}
        return list(spectra.values())

    def _kept(
        self, owner: str, path: _Place, entry: TaskFile, kept: Mapping[tuple[str, str], FloatArray]
    ) -> dict[str, FloatArray]:
        """Spectra of the file that a finished run kept."""
        start = f"{entry.file}:"
        spectra = {
            name[len(start) :]: values
            for (of, name), values in kept.items()
            if (of, name[: len(start)]) == (owner, start)
        }
        if not spectra or not set(entry.columns or ()) <= spectra.keys():
            self.sources.add(path, "the run kept no such curve", entry.file)
        return spectra

    def _read(self, path: _Place, entry: TaskFile) -> dict[str, FloatArray]:
        """Column -> values; those that are nothing on the grid add a fault."""
        sources, curves = self.sources, self.sources.curves(path, entry)
        if curves is None:
            return {}
        names = list(curves.values) if entry.columns is None else entry.columns
        if len(set(names)) < len(names):
            sources.add((*path, "columns"), "a column is named twice", names)
        if not sources.fits(path, "spectra", len(names)):
            return {}
        spectra = {}
        for name in names:
            if entry.quantity == "reflectance":
                values = sources.column(path, curves, name, entry)
                if values is not None and not values.any():
                    sources.add(path, f"{entry.file}: the surface reflects nothing on the wavelength grid", name)
            else:
                values = sources.photons(path, curves, name, entry)
            if values is not None:
                spectra[name] = values
        return spectra

    def _fits(self, path: _Place, classes: Mapping[str, FloatArray]) -> bool:
        """Return whether there are not too many pairs; else adds a fault."""
        sizes = [len(spectra) for spectra in classes.values()]
        pairs = (sum(sizes) ** 2 - sum(size**2 for size in sizes)) // 2
        if pairs > _MOST_PAIRS:
            allowed = f"at most {_MOST_PAIRS:,}: fewer spectra"
            self.sources.add((*path, "classes"), "too many pairs of spectra", pairs, allowed)
        return pairs <= _MOST_PAIRS


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
    own_tasks = OwnTasks(sources)
    made = [own_tasks.task(name, task, (*_AT, "own", name)) for name, task in asked.own.items()]
    if len(sources.faults) > before:
        return None
    conditions = Conditions(asked.exposure_s, asked.read_noise_e, asked.illuminance_lx)
    tasks = (*(shipped(grid, name) for name in asked.shipped), *(task for task in made if task is not None))
    return StudyTasks(conditions, tasks, own_tasks.from_files)


def _shipped_spectra(asked: TasksSection) -> bool:
    """Return whether any spectrum of the package is needed: all that the study has may be lamps from files."""
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
