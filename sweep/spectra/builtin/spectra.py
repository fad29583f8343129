"""Measured and standard spectra of the package, with a data card for each set (`tests/make_spectra.py`)."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Literal

import numpy as np

from ...base.types import PerWavelength
from ..spectrum import Resampling, WavelengthGrid, photons_from_energy, resample

SpectrumKind = Literal["reflectance", "emission"]
_FILE = "spectra.parquet"


@dataclass(frozen=True)
class Spectrum:
    """Spectrum as published: `value` at `wavelength_nm`; emissions in relative power."""

    name: str
    kind: SpectrumKind
    wavelength_nm: PerWavelength
    value: PerWavelength


@dataclass(frozen=True)
class Card:
    """Facts of a set of spectra: source, license, credit, range and digest.

    `groups` are the parts of the set that a task may name, with the number of their spectra. `surrogate` spectra are
    modeled from stated numbers, not measured.
    """

    name: str
    source: str
    license: str
    credit: str
    kind: str
    groups: Mapping[str, int]
    first_nm: float
    last_nm: float
    sha256: str
    surrogate: bool = False


@cache
def _read() -> tuple[dict[str, dict[str, str]], dict[str, dict[str, tuple[Spectrum, ...]]]]:
    """Return the metadata of each set, and its spectra by group, in the file's order."""
    from pyarrow import parquet  # noqa: PLC0415  (few studies need it)

    table = parquet.ParquetFile(str(files(__package__).joinpath(_FILE))).read()
    about = json.loads(table.schema.metadata[b"cards"])
    sets: dict[str, dict[str, list[Spectrum]]] = {}
    for row in table.to_pylist():
        wave, value = (np.asarray(row[key], dtype=float) for key in ("wavelength_nm", "value"))
        spectrum = Spectrum(row["name"], row["kind"], wave, value)
        sets.setdefault(row["set"], {}).setdefault(row["group"], []).append(spectrum)
    groups = {name: {group: tuple(members) for group, members in parts.items()} for name, parts in sets.items()}
    return about, groups


def shipped_groups() -> dict[str, tuple[Spectrum, ...]]:
    """Return the spectra of every group, over all sets."""
    return {group: members for parts in _read()[1].values() for group, members in parts.items()}


def numbers_digest(spectra: tuple[Spectrum, ...]) -> str:
    """Return the SHA-256 of names and numbers (32-bit floats, wavelengths first)."""
    content = hashlib.sha256()
    for spectrum in spectra:
        wave, value = spectrum.wavelength_nm.astype(np.float32), spectrum.value.astype(np.float32)
        content.update(spectrum.name.encode() + wave.tobytes() + value.tobytes())
    return content.hexdigest()


def cards() -> list[Card]:
    """Return the card of each set of the file, with range and digest of its numbers."""
    about, parts = _read()
    entries = []
    for name, groups_of_set in parts.items():
        spectra = tuple(spectrum for group in groups_of_set.values() for spectrum in group)
        sizes = {group: len(members) for group, members in groups_of_set.items()}
        first, last = min(s.wavelength_nm[0] for s in spectra), max(s.wavelength_nm[-1] for s in spectra)
        source, license_, credit = (about[name][key] for key in ("source", "license", "credit"))
        kind = spectra[0].kind
        entries.append(
            Card(name, source, license_, credit, kind, sizes, float(first), float(last), numbers_digest(spectra))
        )
    return entries


def spectrum_of(group: str, name: str) -> Spectrum:
    """Return a spectrum of a group."""
    return next(spectrum for spectrum in shipped_groups()[group] if spectrum.name == name)


def gridded(grid: WavelengthGrid, spectrum: Spectrum) -> PerWavelength:
    """Return a reflectance, or a relative photon spectrum, on the grid.

    On a grid that is coarser than its samples it is the mean over each bin, so that narrow lines keep their photons.
    """
    finest = float(np.diff(spectrum.wavelength_nm).min())
    method: Resampling = "mean" if grid.step_nm > finest else "linear"
    value = resample(spectrum.wavelength_nm, np.maximum(spectrum.value, 0.0), grid, method, "zero")
    return value if spectrum.kind == "reflectance" else photons_from_energy(grid.nodes_nm, value)
