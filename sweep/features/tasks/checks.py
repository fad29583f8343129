"""The tasks of a study on its wavelength grid: those of the package, and own ones from groups and files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...base.errors import Fault, unknown
from ...base.types import FloatArray, PerWavelength
from ...camera.pixel import Pixel, irradiance_factor
from ...camera.scene import Scene
from ...camera.sensor import SensorCurves
from ...designs.space import Space
from ...spectra.builtin.groups import groups, is_surface, spectra_of_group
from ...spectra.formats import is_curve_file
from ...spectra.spectrum import WavelengthGrid
from ...spectra.units import Use
from ...study.schema import StudySection
from ...study.sources import Sources
from ...study.tree import KeyPath
from .keys import TaskFile, TasksSection, UserTask
from .spectra import ILLUMINANTS, SHIPPED, Conditions, GriddedTask, StudyTasks
from .task_sets import THERMAL_K, separation_task, shipped

_AT = ("tasks",)
_MOST_PAIRS = 200_000


def tasks_of(section: TasksSection, sources: Sources) -> StudyTasks | None:
    """Construct the tasks of a study."""
    before = len(sources.issues)
    user_tasks = section.own.values()
    named = [entry for task in user_tasks for spectra in task.classes.values() for entry in spectra]
    lights = {light for task in user_tasks for light in task.under}
    thermal = lights <= THERMAL_K.keys() and 380 <= sources.grid.start_nm <= sources.grid.stop_nm <= 1000
    if section.shipped or (lights and not thermal) or any(isinstance(entry, str) for entry in named):
        sources.in_built_in_range("the spectra of the tasks")
    for name in section.shipped:
        if name not in SHIPPED:
            sources.refuse(unknown((*_AT, "shipped"), "task", name, SHIPPED))
    if len(sources.issues) > before:
        return None
    own_tasks = [_user_task(name, task, sources) for name, task in section.own.items()]
    if len(sources.issues) > before:
        return None
    conditions = Conditions(section.exposure_s, section.read_noise_e, section.illuminance_lx)
    tasks = (
        *(shipped(sources.grid, name) for name in section.shipped),
        *(task for task in own_tasks if task is not None),
    )
    return StudyTasks(conditions, tasks)


def _user_task(name: str, task: UserTask, sources: Sources) -> GriddedTask | None:
    """Return a task, or None after adding issues."""
    before, at = len(sources.issues), (*_AT, "own", name)
    for light in task.under:
        if light not in ILLUMINANTS:
            sources.refuse(unknown((*at, "under"), "light", light, ILLUMINANTS))
    if len(set(task.under)) < len(task.under):
        sources.refuse(Fault((*at, "under"), "a light is named twice", task.under))
    sources.refuse(*_check_names(name, task, at))
    if len(sources.issues) > before:
        return None
    classes: dict[str, FloatArray] = {}
    for kind, entries in task.classes.items():
        spectra: list[FloatArray] = []
        files: set[str] = set()
        for index, entry in enumerate(entries):
            path = (*at, "classes", kind, index)
            if isinstance(entry, str):
                spectra += list(spectra_of_group(sources.grid, entry))
            elif entry.file in files:
                sources.refuse(Fault((*path, "file"), "the class has this file already", entry.file))
            else:
                files.add(entry.file)
                spectra += _read(path, entry, sources)
        classes[kind] = np.array(spectra).reshape(-1, sources.grid.size)
    sizes = [len(spectra) for spectra in classes.values()]
    pairs = (sum(sizes) ** 2 - sum(size**2 for size in sizes)) // 2
    if len(sources.issues) == before and pairs > _MOST_PAIRS:
        allowed = f"at most {_MOST_PAIRS:,}: fewer spectra"
        sources.refuse(Fault((*at, "classes"), "too many pairs of spectra", pairs, allowed))
    return separation_task(sources.grid, name, classes, task.under) if len(sources.issues) == before else None


def _check_names(name: str, task: UserTask, path: KeyPath) -> Iterator[Fault]:
    """Check that its groups and lights are known, and that its classes are all lamps, or all surfaces."""
    known = groups()
    if name in SHIPPED:
        yield Fault(path, "a task of the package has this name", name, "another name")
    surfaces = set()
    for kind, entries in task.classes.items():
        for entry in entries:
            if isinstance(entry, TaskFile):
                surfaces.add(entry.quantity == "reflectance")
            elif entry in known:
                surfaces.add(is_surface(entry))
            elif is_curve_file(entry):
                allowed = f"{{file: {entry}, quantity: reflectance}}, or energy, or photons"
                yield Fault((*path, "classes", kind), "the unit of its numbers is missing", entry, allowed)
            else:
                yield unknown((*path, "classes", kind), "group of spectra", entry, known)
    if len(surfaces) > 1:
        yield Fault((*path, "classes"), "a task is of lamps, or of surfaces", list(task.classes), "one of both")
    elif surfaces == {True} and not task.under:
        yield Fault((*path, "under"), "surfaces need light", None, ", ".join(ILLUMINANTS))
    elif surfaces == {False} and task.under:
        yield Fault((*path, "under"), "lamps are seen by their own light", task.under, "leave it out")


def _read(path: KeyPath, entry: TaskFile, sources: Sources) -> list[PerWavelength]:
    """Return reflectance or relative photons of columns on the grid; a column that is 0 there adds an issue."""
    use: Use = "surface" if entry.quantity == "reflectance" else "light"
    curves = sources.used(path, entry, use, entry.columns, entry.quantity, scaled=True)
    if curves is None:
        return []
    names = list(curves.values) if entry.columns is None else entry.columns
    if len(set(names)) < len(names):
        sources.refuse(Fault((*path, "columns"), "a column is named twice", names))
    if not sources.fits(path, "spectra", len(names)):
        return []
    spectra = []
    for name in names:
        if entry.quantity == "reflectance":
            values = sources.column(path, curves, name, entry)
            if values is not None and not values.any():
                sources.refuse(Fault(path, f"{entry.file}: the surface reflects nothing on the wavelength grid", name))
        else:
            values = sources.photons(path, curves, name, entry)
        if values is not None:
            spectra.append(values)
    return spectra


def check_tasks_in_scenes(
    tasks: StudyTasks, section: StudySection, sensor: SensorCurves, spaces: Sequence[Space]
) -> Iterator[Fault]:
    """Find a task whose filter depends on the angle, or whose patches saturate a pixel."""
    filters = [space.filter.technology for space in spaces if space.filter is not None]
    if any(t is not None and t.interference is not None for t in (*filters, *sensor.technologies.values())):
        yield Fault(
            _AT, "tasks see filters that do not move with the angle of the light", None, "no interference filter"
        )
    for name, scene in section.scenarios.items():
        pixel = scene.pixel_of(section.pixel)
        electrons = max(_most_electrons(tasks, scene, pixel, sensor, section.wavelengths))
        most = min(pixel.well_e, pixel.full_scale_dn / pixel.dn_per_e)
        if electrons > most:
            value = f"{electrons:.3g} electrons in scenario {name}"
            yield Fault((*_AT, "exposure_s"), "a patch of a task fills the well", value, f"at most {most:.3g}")


def _most_electrons(
    tasks: StudyTasks, scene: Scene, pixel: Pixel, sensor: SensorCurves, grid: WavelengthGrid
) -> Iterator[float]:
    """Yield the electrons of the brightest patch of each task behind the sensor's brightest curve."""
    factor = irradiance_factor(scene.optics) * pixel.area_m2 * tasks.conditions.exposure_s
    brightest: FloatArray = np.max(list(sensor.qe.values()), axis=0) * grid.bins_nm
    for task in tasks.tasks:
        if task.photons is not None:
            yield float((task.photons * scene.photon_radiance @ brightest).max()) * factor
        if task.chart is not None:
            yield float((task.chart.photons * tasks.conditions.illuminance_lx @ brightest).max()) * factor
