"""Assign columns of a file of lights to signal types by their colors."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from ..base.errors import DataError, ValidationIssue
from . import LightUnit
from .facts import Curve, merge_equal_issues
from .formats import curves_from, scan_curves
from .signal_color import LightColor
from .spectrum import Curves, WavelengthGrid
from .units import used_as

_SIGNAL_COLORS = ("green", "yellow", "orange", "red")
"""Signal types in the order of a study."""
MOST_LETTERS = 100
"""Longest name that is made of a file's."""
_USUAL = WavelengthGrid()


@dataclass(frozen=True)
class LightsEntry:
    """Lights of one file or folder: columns of each signal type with their colors.

    `quantity`: that of all columns, None if they differ. `ends_early`: a curve ends inside the wavelengths of the
    study; `fine`: it is finer than 1 nm.
    """

    path: Path
    quantity: LightUnit | None
    types: Mapping[str, Mapping[str, LightColor]]
    ends_early: bool
    fine: bool

    def keys(self, file: str) -> dict[str, Any]:
        """Return the keys of a study for these lights, by the path that the study has."""
        entry: dict[str, Any] = {"file": file} | ({} if self.quantity is None else {"quantity": self.quantity})
        entry["signals"] = {kind: list(columns) for kind, columns in self.types.items()}
        entry |= {"outside": "zero"} if self.ends_early else {}
        return entry | ({"resampling": "mean"} if self.fine else {})


@dataclass(frozen=True)
class LightsFile:
    """Lights of files, other columns with the reason why they are left out, and notes on how files were read."""

    name: str
    entries: tuple[LightsEntry, ...]
    left_out: Mapping[str, str]
    notes: tuple[str, ...]

    @property
    def types(self) -> dict[str, list[str]]:
        """Columns of each signal type, in the order of a study."""
        known = {
            kind: [name for entry in self.entries for name in entry.types.get(kind, ())] for kind in _SIGNAL_COLORS
        }
        return {kind: names for kind, names in known.items() if names}

    def keys(self, path_in_study: Callable[[Path], str]) -> dict[str, Any]:
        """Return the keys of a study for these lights."""
        return {"name": self.name, "files": [entry.keys(path_in_study(entry.path)) for entry in self.entries]}


def clean_curves(path: Path) -> Curves:
    """Return the curves of a file or folder. Raises DataError with all issues where they are not clean."""
    scan = scan_curves(path)
    if scan.issues:
        raise DataError(merge_equal_issues(list(chain.from_iterable(scan.issues))))
    return curves_from(scan, path)


def lights_file(
    paths: Path | Sequence[Path], quantity: LightUnit | None = None, start_nm: float = 400, stop_nm: float = 700
) -> LightsFile:
    """Return the lights of files or folders by their colors, for a study between two wavelengths.

    `quantity`: that of the values; left out, what the heads say, else energy. Raises DataError if there are fewer than
    two signal colors.
    """
    places = [paths] if isinstance(paths, Path) else list(paths)
    left_out: dict[str, str] = {}
    entries, notes = [], []
    for path in places:
        read = clean_curves(path)
        curves = used_as(read, list(read.values), "light", quantity)
        types: dict[str, dict[str, LightColor]] = {}
        for name in curves.values:
            color = Curve(name, *curves.samples(name)).color(
                "energy" if curves.units[name].quantity == "energy" else "photons"
            )
            if color is not None and color.signal is not None:
                types.setdefault(color.signal, {})[name] = color
            elif color is None:
                left_out[name] = "no visible light"
            else:
                left_out[name] = f"xy {color.xy[0]:.3f} {color.xy[1]:.3f} is near no signal color"
        ends = [curves.samples(name)[0] for of_type in types.values() for name in of_type]
        early = any(wave[0] > start_nm or wave[-1] < stop_nm for wave in ends)
        fine = any(bool(np.diff(wave).min() < _USUAL.step_nm) for wave in ends)
        known = {curves.units[name].quantity for of_type in types.values() for name in of_type}
        of_all: LightUnit | None = "photons" if known == {"photons"} else "energy" if known == {"energy"} else None
        ordered = {kind: types[kind] for kind in _SIGNAL_COLORS if kind in types}
        if ordered:
            entries.append(LightsEntry(path, of_all, ordered, early, fine))
        notes += [note if len(places) == 1 else f"{path.name}: {note}" for note in curves.notes[len(read.notes) :]]
    found = LightsFile(places[0].stem[:MOST_LETTERS], tuple(entries), left_out, tuple(notes))
    if len(found.types) < 2:
        listed = "; ".join(f"{kind}: {', '.join(columns)}" for kind, columns in found.types.items()) or "none"
        problem = f"lights of one signal color or none (`sweep describe {places[0]}` shows where they lie)"
        allowed = "two of green, yellow, orange, red, or more"
        raise DataError(ValidationIssue(problem, str(places[0]), None, None, listed, allowed))
    return found
