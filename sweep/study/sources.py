"""Curves that a study names: built in, or from files beside the study or in a data folder."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeVar

from ..base.disk import is_file
from ..base.errors import MOST_FAULTS, DataError, Fault, SweepError, nearest
from ..base.types import FloatArray
from ..camera.sensor import SensorCurves
from ..curves.builtin.registry import BUILT_IN_LIGHTS
from ..curves.builtin.surrogate import BUILT_IN_RANGE_NM
from ..curves.files import digest, read_curves
from ..curves.lens_files import ChiefRays, read_chief_rays
from ..curves.lights import Lights, make_lights
from ..curves.spectrum import Curves, WavelengthGrid, photons_from_energy
from .document import Document
from .schema import MOST_TYPES
from .schema_curves import CurveFile, LightFile, LightsSection, TaskFile
from .yaml_tree import Key

_Made = TypeVar("_Made", SensorCurves, Lights)
_Content = TypeVar("_Content", Curves, ChiefRays)
_MOST_VALUES = 10_000_000
"""Most values of the curves of a sensor, or of lights, on the grid: 80 MB."""
_CUT_OFF = 0.01
"""Share of a light's photons outside the grid from which on the user is told."""


_Key = TypeVar("_Key")
_Entry = CurveFile | LightFile | TaskFile
"""A file of curves as a study names it."""


@dataclass(frozen=True)
class KeptSources:
    """Curves to take instead of those in files, on the study's grid: QE by name, photons by type and name, spectra of
    own tasks by class and name.
    """

    sensor: Mapping[str, FloatArray]
    lights: Mapping[tuple[str, str], FloatArray]
    tasks: Mapping[tuple[str, str], FloatArray] = field(default_factory=dict)


@dataclass
class Sources:
    """Reads the files of one study, each once; collects faults, warnings and digests.

    `kept`: the curves of a finished run; no file is read then. `given`: files that are not on a disk, by their names.
    `allow_code`: code that the study names may run, or of it what has these digests.
    """

    document: Document
    grid: WavelengthGrid
    folders: Sequence[Path]
    kept: KeptSources | None = None
    given: Mapping[str, Curves] = field(default_factory=dict)
    allow_code: bool | Mapping[str, str] = False
    faults: list[Fault] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    digests: dict[str, str] = field(default_factory=dict)
    _read: dict[str, Curves | None] = field(default_factory=dict)

    def unknown(
        self, path: tuple[Key, ...], what: str, value: str, known: list[str], others: Iterable[str] = ()
    ) -> None:
        """Add the fault of a name that is not among the known ones, with the nearest of them and of `others`."""
        if len(self.faults) < MOST_FAULTS:
            self.add(path, f"unknown {what}", value, ", ".join(known), nearest(value, [*known, *others]))
        else:  # nobody reads it
            self.add(path, f"unknown {what}", value)

    def held_out(self, section: LightsSection, own: Lights) -> Lights | None:
        """Lights that the study does not optimize for, as bright as its own, or None after adding faults.

        Those of a finished run are not kept: None, too.
        """
        if self.kept is not None:
            return None
        path = ("validate", "lights")
        lights = self.lights(section, path)
        if lights is None:
            return None
        for name in lights.classes:
            if name not in own.classes:
                self.unknown(path, "signal type", name, list(own.classes))
        return replace(lights, photon_ratio=own.photon_ratio)

    def lights(self, section: LightsSection, at: tuple[Key, ...] = ("lights",)) -> Lights | None:
        """The lights of the section at a place of the study, or None after adding faults."""
        if section.builtin is not None:
            own = sorted(section.model_fields_set - {"builtin", "files"})
            for key in own:
                self.add(
                    (*at, key), "a built-in data set has its own", getattr(section, key), "this key beside `files`"
                )
            return None if own else self.built_in(at, section.builtin, BUILT_IN_LIGHTS)
        before = len(self.faults)
        used = [len(columns) for entry in section.files for columns in entry.signals.values()]
        if not self.fits((*at, "files"), "lights", sum(used)):
            return None
        by_type: dict[str, list[tuple[str, str, FloatArray]]] = {}
        for index, entry in enumerate(section.files):
            path = (*at, "files", index)
            curves = self.curves(path, entry)
            for signal_type, columns in entry.signals.items():
                for position, column in enumerate(columns):
                    place = (*path, "signals", signal_type, position)
                    label = f"{Path(entry.file).stem}:{column}"
                    if self.kept is not None:
                        photons = self.kept_curve(place, self.kept.lights, (signal_type, label))
                    else:
                        photons = self.photons(place, curves, column, entry)
                    if photons is not None:
                        by_type.setdefault(signal_type, []).append((label, signal_type, photons))
        if len(self.faults) > before:
            return None
        if len(by_type) < 2:
            self.add((*at, "files"), "only one signal type", list(by_type), "two or more, to tell them apart")
            return None
        if len(by_type) > MOST_TYPES:
            self.add((*at, "files"), "too many signal types", len(by_type), f"at most {MOST_TYPES}")
            return None
        signals = [signal for group in by_type.values() for signal in group]
        source = ", ".join(entry.file for entry in section.files)
        return make_lights(self.grid, section.name or "lights", signals, source, photon_ratio=section.photon_ratio)

    def fits(self, path: tuple[Key, ...], what: str, count: int) -> bool:
        """Return whether so many curves on the grid fit into memory; else adds a fault."""
        most = _MOST_VALUES // self.grid.size
        if count > most:
            self.add(path, f"too many {what} for a grid of {self.grid.size:,} wavelengths", count, f"at most {most:,}")
        return count <= most

    def built_in(
        self, at: tuple[Key, ...], name: str, known: Mapping[str, Callable[[WavelengthGrid], _Made]]
    ) -> _Made | None:
        """A sensor or lights of the package on the grid, or None after adding faults."""
        if name not in known:
            allowed = f"{', '.join(known)}, or a mapping with `files`"
            self.add(at, f"unknown built-in {at[-1]}", name, allowed, nearest(name, known))
            return None
        low, high = BUILT_IN_RANGE_NM
        if not low <= self.grid.start_nm < self.grid.stop_nm <= high:
            asked = f"{self.grid.start_nm:g} to {self.grid.stop_nm:g} nm"
            fault = self.document.fault(
                ("wavelengths",), "the built-in curves end before the grid", asked, f"{low:g} to {high:g} nm"
            )
            if fault not in self.faults:
                self.faults.append(fault)
            return None
        return known[name](self.grid)

    def photons(
        self, path: tuple[Key, ...], curves: Curves | None, column: str, entry: LightFile | TaskFile
    ) -> FloatArray | None:
        """A light's photon spectrum on the grid; says so when photons are cut off."""
        values = self.column(path, curves, column, entry)
        if values is None or curves is None:
            return None
        wave, raw = curves.wavelength_nm, curves.values[column]
        if entry.quantity == "energy":
            raw = photons_from_energy(wave, raw)
            values = photons_from_energy(self.grid.nodes_nm, values)
        if not values.any():
            self.add(path, "the light has no photons on the wavelength grid", column)
            return None
        total = float(((raw[1:] + raw[:-1]) / 2 * (wave[1:] - wave[:-1])).sum())
        lost = 1 - float(self.grid.integrate(values)) / total
        if lost > _CUT_OFF:
            self.warnings.append(
                f"{entry.file}: {column}: {lost:.1%} of its photons lie outside the wavelength grid and are cut off"
            )
        return values

    def column(self, path: tuple[Key, ...], curves: Curves | None, column: str, entry: _Entry) -> FloatArray | None:
        """A column of a file on the grid, ndarray[n_wavelengths], or None after adding faults."""
        if curves is None:
            return None
        if column not in curves.values:
            self.unknown(path, f"column of {entry.file}", column, list(curves.values))
            return None
        try:
            return curves.on(self.grid, column, entry.resampling, entry.outside)
        except DataError as error:
            for fault in error.faults:
                self.add(path, f"{entry.file}, column {column}: {fault.problem}", fault.value, fault.allowed)
            return None

    def kept_curve(self, path: tuple[Key, ...], curves: Mapping[_Key, FloatArray], name: _Key) -> FloatArray | None:
        """A curve that a finished run kept, or None after adding a fault."""
        if name not in curves:
            self.add(path, "the run kept no such curve", name)
        return curves.get(name)

    def curves(self, path: tuple[Key, ...], entry: _Entry) -> Curves | None:
        """All curves of a file, which is read once, or None after adding faults."""
        if self.kept is not None:
            return None
        if entry.file in self._read:
            return self._read[entry.file]
        if entry.file in self.given:
            curves = self._read[entry.file] = self.given[entry.file]
            content = hashlib.sha256(curves.wavelength_nm.tobytes())
            for name, values in curves.values.items():
                content.update(name.encode() + values.tobytes())
            self.digests[entry.file] = content.hexdigest()
            return curves
        self._read[entry.file] = self._noted((*path, "file"), entry.file, read_curves)
        return self._read[entry.file]

    def chief_rays(self, path: tuple[Key, ...], file: str, corner_mm: float | None) -> ChiefRays | None:
        """A lens's chief ray angles from a file that the study names at `path`, or None after adding faults."""
        return self._noted(path, file, lambda place: read_chief_rays(place, corner_mm))

    def _noted(self, path: tuple[Key, ...], file: str, read: Callable[[Path], _Content]) -> _Content | None:
        """Content of a file, with its notes and its digest kept; None after adding faults."""
        place = self.file(path, file)
        if place is None:
            return None
        try:
            content = read(place)
            self.digests[file] = digest(place)
        except DataError as error:
            self.faults.extend(error.faults)
            return None
        self.warnings += [f"{file}: {note}" for note in content.notes]
        return content

    def file(self, path: tuple[Key, ...], file: str) -> Path | None:
        """Where a file lies that the study names at `path`, or None after adding a fault."""
        place = next((folder / file for folder in self.folders if is_file(folder / file)), None)
        if place is None:
            searched = ", ".join(str(folder) for folder in self.folders)
            names: list[str] = []
            for folder in self.folders:
                with suppress(OSError):
                    names += [item.name for item in folder.iterdir()]
            self.add(path, "no such file", file, f"a path relative to {searched}", nearest(file, names))
        return place

    def add(
        self,
        path: tuple[Key, ...],
        problem: str,
        value: object = None,
        allowed: str | None = None,
        near: str | None = None,
    ) -> None:
        """Add a fault at `path` of the study file."""
        self.faults.append(self.document.fault(path, problem, value, allowed, near))

    def told(self, path: tuple[Key, ...], error: SweepError) -> None:
        """Add the faults of an error at `path` of the study file."""
        for fault in error.faults:
            problem = f"{fault.file}: {fault.problem}" if fault.file else fault.problem
            self.add(path, problem, fault.value, fault.allowed, fault.nearest)
