"""Spectra of a study's own tasks: groups that the package ships, and files of curves."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from ..base.types import FloatArray
from ..curves.builtin.task_sets import group, is_surface, separation_task, task_groups
from ..curves.files import is_curve_file
from ..curves.tasks import ILLUMINANTS, SHIPPED, GriddedTask
from .schema_curves import TaskFile
from .schema_tasks import OwnTask
from .sources import Sources
from .yaml_tree import Key

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
        found: dict[str, FloatArray] = {}
        for kind, named in asked.classes.items():
            path = (*at, "classes", kind)
            spectra = [one for each in self._places(path, named) for one in self._spectra(f"{name} {kind}", *each)]
            found[kind] = np.array(spectra).reshape(-1, self.sources.grid.size)
        if len(self.sources.faults) > before or not self._fits(at, found):
            return None
        return separation_task(self.sources.grid, name, found, asked.under)

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
            found = self._kept(owner, path, each, sources.kept.tasks)
        else:
            found = self._read(path, each)
        self.from_files |= {(owner, f"{each.file}:{column}"): values for column, values in found.items()}
        return list(found.values())

    def _kept(
        self, owner: str, path: _Place, entry: TaskFile, kept: Mapping[tuple[str, str], FloatArray]
    ) -> dict[str, FloatArray]:
        """What a finished run kept of the file."""
        start = f"{entry.file}:"
        own = {
            name[len(start) :]: values
            for (of, name), values in kept.items()
            if (of, name[: len(start)]) == (owner, start)
        }
        if not own or not set(entry.columns or ()) <= own.keys():
            self.sources.add(path, "the run kept no such curve", entry.file)
        return own

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
        found = {}
        for name in names:
            if entry.quantity == "reflectance":
                values = sources.column(path, curves, name, entry)
                if values is not None and not values.any():
                    sources.add(path, f"{entry.file}: the surface reflects nothing on the wavelength grid", name)
            else:
                values = sources.photons(path, curves, name, entry)
            if values is not None:
                found[name] = values
        return found

    def _fits(self, path: _Place, classes: Mapping[str, FloatArray]) -> bool:
        """Whether there are not too many pairs; else adds a fault."""
        sizes = [len(spectra) for spectra in classes.values()]
        pairs = (sum(sizes) ** 2 - sum(size**2 for size in sizes)) // 2
        if pairs > _MOST_PAIRS:
            allowed = f"at most {_MOST_PAIRS:,}: fewer spectra"
            self.sources.add((*path, "classes"), "too many pairs of spectra", pairs, allowed)
        return pairs <= _MOST_PAIRS
