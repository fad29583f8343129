"""Files and built-in curves that a study names, and all issues that are found in it."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import TypeVar

import numpy as np

from ..base.disk import is_file, is_folder, read_input
from ..base.errors import MOST_ISSUES, DataError, Fault, StudyError, ValidationIssue, faults_of, nearest, unknown
from ..base.types import PerWavelength
from ..camera.sensor import SensorCurves
from ..spectra.builtin.surrogate import BUILT_IN_RANGE_NM, MODELED
from ..spectra.colorants import BUILTIN_COLORANTS, Colorants, read_colorants
from ..spectra.formats import digest, read_curves
from ..spectra.lens_files import ChiefRays, read_chief_rays
from ..spectra.lights import Lights
from ..spectra.spectrum import (
    Curves,
    Quantity,
    WavelengthGrid,
    integral_between,
    photons_from_energy,
)
from ..spectra.units import Use, used_as
from .document import Document, by_line
from .inputs import Input, input_at, input_given
from .partial import Partial
from .schema_curves import ColorantsSection, FileEntry
from .tree import KeyPath

_MOST_VALUES = 10_000_000
"""Most values of the curves of a sensor, or of lights, on the grid: 80 MB."""
_MOST_BYTES, _MOST_DESIGNS = 10_000_000, 10_000
"""Of a file of designs."""
_MOST_REFUSED = 5
"""Spectra that were not read and that a note names."""
_CUT_OFF = 0.01
"""Share of a light's photons outside the grid from which on the user gets a warning."""
_MISCOUNTED = 0.01
"""The same of photons that sampling at the nodes loses or adds."""
_Made = TypeVar("_Made", SensorCurves, Lights)
_Content = TypeVar("_Content", Curves, ChiefRays)


@dataclass
class Sources:
    """Reader of the files of one study, each once; collects issues, warnings and digests.

    `given`: files that are not on a disk, by their names; `kept`: where a run kept those that it was made from.
    `allow_code`: code that the study names may run, or only code with these digests. `partial`: of a study with faulty
    keys, whose issues are told with all others, and for which checks wait. `inputs`: what was read.
    """

    document: Document
    grid: WavelengthGrid
    folders: Sequence[Path]
    given: Mapping[str, Curves] = field(default_factory=dict)
    kept: Mapping[str, Path] = field(default_factory=dict)
    allow_code: bool | Mapping[str, str] = False
    partial: Partial | None = None
    issues: list[ValidationIssue] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    digests: dict[str, str] = field(default_factory=dict)
    inputs: dict[str, Input] = field(default_factory=dict)
    _read: dict[str, Curves | None] = field(default_factory=dict)
    _waiting: list[ValidationIssue] = field(default_factory=list)

    @property
    def error(self) -> StudyError:
        """All issues, in the order of their lines."""
        of_schema = [] if self.partial is None else self.partial.issues
        told = [issue for issue in self.issues if not any(issue is other for other in self._waiting)]
        return StudyError(by_line([*of_schema, *told]))

    def refuse(self, *faults: Fault) -> None:
        """Collect faults; those of checks that wait for faulty keys are not told."""
        for fault in faults:
            near = fault.nearest
            if fault.known and len(self.issues) < MOST_ISSUES:
                near = nearest(fault.value, fault.known)
            self.issues.append(self.document.issue(fault.path, fault.problem, fault.value, fault.allowed, near))
            if self.partial is not None and self.partial.waits(fault):
                self._waiting.append(self.issues[-1])

    def fits(self, path: KeyPath, what: str, count: int) -> bool:
        """Return True if curves on the wavelength grid fit into memory; add an issue otherwise."""
        most = _MOST_VALUES // self.grid.size
        if count > most:
            self.refuse(
                Fault(path, f"too many {what} for a grid of {self.grid.size:,} wavelengths", count, f"at most {most:,}")
            )
        return count <= most

    def built_in(
        self,
        at: KeyPath,
        name: str,
        known: Mapping[str, Callable[[WavelengthGrid], _Made]],
        *,
        anywhere: bool = False,
    ) -> _Made | None:
        """Return a built-in sensor or lights on the study's wavelengths, also beyond theirs; None after issues."""
        if name not in known:
            shown = dict.fromkeys(re.sub(r"/.*", "/NAME", re.sub(r"@.*", "@NUMBER", one)) for one in known)
            allowed = f"{', '.join(shown)}, or a mapping with `files`"
            self.refuse(Fault(at, f"unknown built-in {at[-1]}", name, allowed, nearest(name, known)))
            return None
        try:
            inside = anywhere or name.partition("@")[0] not in MODELED or self.in_built_in_range("the built-in curves")
            return known[name](self.grid) if inside else None
        except DataError as error:
            (first, *_) = error.issues
            self.refuse(
                Fault(("wavelengths",), f"{name} has curves from {first.value}", None, "wavelengths within them")
            )
            return None

    def in_built_in_range(self, what: str) -> bool:
        """Return True if the wavelength grid lies inside that of the built-in curves; add one issue otherwise."""
        low, high = BUILT_IN_RANGE_NM
        inside = low <= self.grid.start_nm < self.grid.stop_nm <= high
        grid = f"{self.grid.start_nm:g} to {self.grid.stop_nm:g} nm"
        fault = Fault(("wavelengths",), f"{what} end before the grid", grid, f"{low:g} to {high:g} nm")
        if not inside and not any(issue.problem == fault.problem for issue in self.issues):
            self.refuse(fault)
        return inside

    def photons(self, path: KeyPath, curves: Curves | None, column: str, entry: FileEntry) -> PerWavelength | None:
        """Return the photon spectrum of a light; warn about photons outside the wavelength grid or between its nodes.

        Returns relative photons per nm. None after adding issues.
        """
        values = self.column(path, curves, column, entry)
        if values is None or curves is None:
            return None
        wave, raw = curves.samples(column)
        if curves.units[column].quantity == "energy":
            raw = photons_from_energy(wave, raw)
            values = photons_from_energy(self.grid.nodes_nm, values)
        first_nm, last_nm, step_nm = self.grid.start_nm, self.grid.stop_nm, self.grid.step_nm
        inside = integral_between(wave, raw, first_nm, last_nm)
        if not values.any():
            between = f", but between its nodes, {step_nm:g} nm apart" if inside > 0 else ""
            finer = "a finer `wavelengths: {step_nm: ...}`, or `resampling: mean`" if inside > 0 else None
            self.refuse(Fault(path, f"the light has no photons on the wavelength grid{between}", column, finer))
            return None
        total = integral_between(wave, raw, wave[0], wave[-1])
        outside = 1 - inside / total
        if outside > _CUT_OFF:
            self.warnings.append(
                f"{entry.file}: {column}: {outside:.1%} of its photons lie outside the wavelength grid and are cut off"
            )
        sampled = float(self.grid.integrate(values))
        if abs(sampled - inside) > _MISCOUNTED * total:
            self.warnings.append(
                f"{entry.file}: {column}: sampled every {step_nm:g} nm it has {sampled / total:.1%} of its photons "
                f"instead of {inside / total:.1%}, since its features are narrower: choose a finer "
                "`wavelengths: {step_nm: ...}`, or `resampling: mean`"
            )
        return values

    def column(self, path: KeyPath, curves: Curves | None, column: str, entry: FileEntry) -> PerWavelength | None:
        """Interpolate a column of a file on the study's wavelength grid."""
        if curves is None:
            return None
        if column not in curves.values:
            self.refuse(unknown(path, f"column of {entry.file}", column, curves.values))
            return None
        try:
            return curves.on(self.grid, column, entry.resampling, entry.outside)
        except DataError as error:
            for issue in error.issues:
                self.refuse(Fault(path, f"{entry.file}, column {column}: {issue.problem}", issue.value, issue.allowed))
            return None

    def curves(self, path: KeyPath, entry: FileEntry) -> Curves | None:
        """Read all curves of a file, once per study."""
        if entry.file not in self._read and entry.file in self.given:
            curves = self._read[entry.file] = self.given[entry.file]
            content = hashlib.sha256(curves.wavelength_nm.tobytes())
            for name, values in curves.values.items():
                content.update(name.encode() + values.tobytes())
            self.digests[entry.file], self.inputs[entry.file] = content.hexdigest(), input_given(curves)
        elif entry.file not in self._read:
            self._read[entry.file] = self._content((*path, "file"), entry.file, read_curves)
        return self._read[entry.file]

    def used(
        self,
        path: KeyPath,
        entry: FileEntry,
        use: Use,
        columns: Iterable[str] | None = None,
        stated: Quantity | None = None,
        *,
        scaled: bool = False,
    ) -> Curves | None:
        """Return columns of a file, by default all, in the quantity of their use, as `used_as`; None after issues."""
        curves = self.curves(path, entry)
        if curves is None:
            return None
        names = curves.values if columns is None else columns
        known = [column for column in dict.fromkeys(names) if column in curves.values]
        try:
            used = used_as(curves, known, use, stated, scaled=scaled)
        except DataError as error:
            for issue in error.issues:
                self.refuse(
                    Fault(path, f"{entry.file}, column {issue.key}: {issue.problem}", issue.value, issue.allowed)
                )
            return None
        if entry.file not in self.given and stated is None:
            self.warnings += [f"{entry.file}: {note}" for note in used.notes[len(curves.notes) :]]
        return used

    def colorants(self, section: ColorantsSection) -> Colorants | None:
        """Read the catalog of colorants."""
        path: KeyPath = ("colorants", "catalog")
        for name in BUILTIN_COLORANTS.keys() & set(section.catalog):
            if len(section.catalog) > 1:
                self.refuse(Fault(path, f"the built-in catalog `{name}` goes with no other", section.catalog))
                return None
            return BUILTIN_COLORANTS[name](self.grid)
        places = []
        for name in section.catalog:
            place = self.file(path, name)
            if place is not None:
                places.append(place)
        if len(places) < len(section.catalog):
            return None
        try:
            found = read_colorants(places, self.grid)
        except DataError as error:
            self.refuse(*faults_of(path, error))
            return None
        self.inputs |= {name: input_at(place) for name, place in zip(section.catalog, places, strict=True)}
        content = hashlib.sha256("".join(found.names).encode() + found.absorbance.tobytes() + found.peaks.tobytes())
        self.digests[f"colorants: {', '.join(section.catalog)}"] = content.hexdigest()
        total = len(found) + len(found.refused)
        if found.refused:
            shown = "; ".join(found.refused[:_MOST_REFUSED])
            more = f"; {len(found.refused) - _MOST_REFUSED} more" if len(found.refused) > _MOST_REFUSED else ""
            self.warnings.append(f"colorants: {len(found)} of {total} spectra were read; not {shown}{more}")
        return found

    def chief_rays(self, path: KeyPath, file: str, corner_mm: float | None) -> ChiefRays | None:
        """Read the chief ray angles of a lens.

        `corner_mm`: image height of the corner in mm.
        """
        return self._content(path, file, lambda place: read_chief_rays(place, corner_mm))

    def designs(self, path: KeyPath, file: str) -> list[dict[str, float]] | None:
        """Read designs from a CSV with a column for each parameter; None after adding an issue."""
        place = self.file(path, file)
        if place is None:
            return None
        import pandas as pd  # noqa: PLC0415  (slow to import, and few studies list designs in files)

        content = read_input(place, _MOST_BYTES, StudyError)
        try:
            table = pd.read_csv(BytesIO(content), nrows=_MOST_DESIGNS + 1).astype(float)
        except ValueError as error:
            problem = " ".join(str(error).split())
            allowed = "a head of names, and a row of numbers for each design"
            self.refuse(Fault(path, f"{file}: {problem}", None, allowed))
            return None
        if not 0 < len(table) <= _MOST_DESIGNS or not np.isfinite(table.to_numpy()).all():
            allowed = f"1 to {_MOST_DESIGNS:,} designs, each with a number for every parameter"
            self.refuse(Fault(path, f"{file}: designs that cannot be used", len(table), allowed))
            return None
        self.digests[file] = hashlib.sha256(content).hexdigest()
        return [{str(key): value for key, value in row.items()} for row in table.to_dict("records")]

    def _content(self, path: KeyPath, file: str, read: Callable[[Path], _Content]) -> _Content | None:
        """Return the contents of a file, and keep its notes and its digest; None after adding issues."""
        place = self.file(path, file)
        if place is None:
            return None
        try:
            content = read(place)
            self.digests[file], self.inputs[file] = digest(place), input_at(place)
        except DataError as error:
            self.issues.extend(error.issues)
            return None
        self.warnings += [f"{file}: {note}" for note in content.notes]
        return content

    def file(self, path: KeyPath, file: str) -> Path | None:
        """Return the path of a file that the study names.

        None after adding an issue.
        """
        places = [self.kept[file]] if file in self.kept else [where / file for where in self.folders]
        place = next((place for place in places if is_file(place) or is_folder(place)), None)
        if place is None:
            names: list[str] = []
            for folder in self.folders:
                with suppress(OSError):
                    names += [item.name for item in folder.iterdir()]
            self.refuse(Fault(path, "no such file", file, f"a path relative to {self.searched}", nearest(file, names)))
        return place

    @property
    def searched(self) -> str:
        """Folders in which files are looked for."""
        return ", ".join(str(folder) for folder in self.folders)
