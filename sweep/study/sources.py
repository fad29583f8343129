"""Curves that a study names: built in, or from files beside the study or in a data folder."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeVar

from ..camera.sensor import BUILT_IN_SENSORS, SensorCurves, make_sensor
from ..curves.builtin.registry import BUILT_IN_LIGHTS
from ..curves.builtin.surrogate import BUILT_IN_RANGE_NM
from ..curves.files import digest, read_curves
from ..curves.lights import Lights, make_lights
from ..curves.spectrum import Curves, WavelengthGrid, photons_from_energy
from ..disk import is_file
from ..errors import MOST_FAULTS, DataError, Fault, nearest
from ..types import FloatArray
from .document import Document
from .schema import MOST_TYPES
from .schema_curves import CurveFile, LightFile, LightsSection, SensorSection
from .yaml_tree import Key

_Made = TypeVar("_Made", SensorCurves, Lights)
_MOST_VALUES = 10_000_000
"""Of the curves of a sensor, or of lights, on the grid: 80 MB."""
_CUT_OFF = 0.01
"""Share of a light's photons outside the grid from which on the user is told."""


_Key = TypeVar("_Key")


@dataclass(frozen=True)
class KeptSources:
    """Curves to take instead of those in files, on the study's grid: QE by name, photons by type and name."""

    sensor: Mapping[str, FloatArray]
    lights: Mapping[tuple[str, str], FloatArray]


@dataclass
class Sources:
    """Reads the files of one study, each once; collects faults, warnings and digests.

    `kept`: the curves of a finished run; no file is read then.
    """

    document: Document
    grid: WavelengthGrid
    folders: Sequence[Path]
    kept: KeptSources | None = None
    faults: list[Fault] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    digests: dict[str, str] = field(default_factory=dict)
    _read: dict[str, Curves | None] = field(default_factory=dict)

    def unknown(self, path: tuple[Key, ...], what: str, value: str, known: list[str]) -> None:
        """Add the fault of a name that is not among the known ones, with the nearest of them."""
        told = len(self.faults) < MOST_FAULTS
        self.add(path, f"unknown {what}", value, ", ".join(known) if told else None, self._near(value, known))

    def _near(self, value: str, known: Iterable[str]) -> str | None:
        """The nearest known name, as long as somebody is told of it."""
        return nearest(value, known) if len(self.faults) < MOST_FAULTS else None

    def sensor(self, section: SensorSection) -> SensorCurves | None:
        """The study's sensor, or None after adding faults."""
        if section.builtin is not None:
            return self._built_in(("sensor",), section.builtin, BUILT_IN_SENSORS)
        before = len(self.faults)
        if not self._fits(("sensor", "files"), "curves", sum(len(entry.columns) for entry in section.files)):
            return None
        qe: dict[str, FloatArray] = {}
        for index, entry in enumerate(section.files):
            path: tuple[Key, ...] = ("sensor", "files", index)
            curves = self._curves(path, entry)
            for name, column in entry.columns.items():
                place: tuple[Key, ...] = (*path, "columns", name)
                if name in qe:
                    self.add(place, "the curve is defined twice", name)
                if self.kept is not None:
                    values = self._kept(place, self.kept.sensor, name)
                else:
                    values = self._column(place, curves, column, entry)
                    values = None if values is None else values * entry.scale
                if values is not None:
                    qe[name] = values
        if len(self.faults) > before:
            return None
        name = section.name or "sensor"
        try:
            return make_sensor(name, qe, ", ".join(entry.file for entry in section.files), section.clear)
        except DataError as error:
            for fault in error.faults:
                path = ("sensor", "clear") if fault.key is None else self._qe_path(section, fault.key)
                self.faults.append(self.document.fault(path, fault.problem, fault.value, fault.allowed, fault.nearest))
            return None

    def _qe_path(self, section: SensorSection, curve: str) -> tuple[Key, ...]:
        index = next(i for i, entry in enumerate(section.files) if curve in entry.columns)
        return ("sensor", "files", index, "columns", curve)

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
            return self._built_in(at, section.builtin, BUILT_IN_LIGHTS)
        before = len(self.faults)
        used = [len(columns) for entry in section.files for columns in entry.signals.values()]
        if not self._fits((*at, "files"), "lights", sum(used)):
            return None
        by_type: dict[str, list[tuple[str, str, FloatArray]]] = {}
        for index, entry in enumerate(section.files):
            path = (*at, "files", index)
            curves = self._curves(path, entry)
            for signal_type, columns in entry.signals.items():
                for position, column in enumerate(columns):
                    place = (*path, "signals", signal_type, position)
                    label = f"{Path(entry.file).stem}:{column}"
                    if self.kept is not None:
                        photons = self._kept(place, self.kept.lights, (signal_type, label))
                    else:
                        photons = self._photons(place, curves, column, entry)
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

    def _fits(self, path: tuple[Key, ...], what: str, count: int) -> bool:
        """Whether so many curves on the grid fit into memory; else adds a fault."""
        most = _MOST_VALUES // self.grid.size
        if count > most:
            self.add(path, f"too many {what} for a grid of {self.grid.size:,} wavelengths", count, f"at most {most:,}")
        return count <= most

    def _built_in(
        self, at: tuple[Key, ...], name: str, known: Mapping[str, Callable[[WavelengthGrid], _Made]]
    ) -> _Made | None:
        if name not in known:
            self.add(
                at,
                f"unknown built-in {at[-1]}",
                name,
                f"{', '.join(known)}, or a mapping with `files`",
                nearest(name, known),
            )
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

    def _photons(
        self, path: tuple[Key, ...], curves: Curves | None, column: str, entry: LightFile
    ) -> FloatArray | None:
        """A light's photon spectrum on the grid; says so when photons are cut off."""
        values = self._column(path, curves, column, entry)
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

    def _column(
        self, path: tuple[Key, ...], curves: Curves | None, column: str, entry: CurveFile | LightFile
    ) -> FloatArray | None:
        if curves is None:
            return None
        if column not in curves.values:
            known = list(curves.values)
            self.add(path, f"{entry.file} has no such column", column, ", ".join(known), self._near(column, known))
            return None
        try:
            return curves.on(self.grid, column, entry.resampling, entry.outside)
        except DataError as error:
            for fault in error.faults:
                self.add(path, f"{entry.file}, column {column}: {fault.problem}", fault.value, fault.allowed)
            return None

    def _kept(self, path: tuple[Key, ...], curves: Mapping[_Key, FloatArray], name: _Key) -> FloatArray | None:
        if name not in curves:
            self.add(path, "the run kept no such curve", name)
        return curves.get(name)

    def _curves(self, path: tuple[Key, ...], entry: CurveFile | LightFile) -> Curves | None:
        if self.kept is not None:
            return None
        if entry.file in self._read:
            return self._read[entry.file]
        self._read[entry.file] = None
        found = next((folder / entry.file for folder in self.folders if is_file(folder / entry.file)), None)
        if found is None:
            searched = ", ".join(str(folder) for folder in self.folders)
            near = self._near(entry.file, _names(self.folders))
            self.add((*path, "file"), "no such file", entry.file, f"a path relative to {searched}", near)
            return None
        try:
            self._read[entry.file] = read_curves(found)
            self.digests[entry.file] = digest(found)
        except DataError as error:
            self.faults.extend(error.faults)
        return self._read[entry.file]

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


def _names(folders: Iterable[Path]) -> Iterator[str]:
    """Names of what lies in folders, as far as they can be read."""
    for folder in folders:
        with suppress(OSError):
            yield from (item.name for item in folder.iterdir())
