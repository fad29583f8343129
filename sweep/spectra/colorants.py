"""Colorants: absorption spectra of a built-in catalog, a file, or a folder of files."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from ..base.errors import DataError, ValidationIssue
from ..base.types import Array, Float, FloatArray, PerSample
from .formats import is_curve_file, scan_curves
from .spectrum import WavelengthGrid

_PEAKS_NM = range(560, 701, 10)
_FWHM_NM = (30, 40, 50)
_FILMS = Path(__file__).parent / "builtin" / "films.csv"
_MOST_COLORANTS = 10_000
_END = 0.02
"""Share of the peak up to which a spectrum may end inside the grid; it is 0 from there on."""
GAUSSIAN = 4 * math.log(2)
"""exp(-GAUSSIAN u^2) is 1/2 where u is 1/2: u is in widths at half height."""


@dataclass(frozen=True)
class Colorants:
    """Absorption spectra with a peak of 1, and what was not read.

    `absorbance`: absorbance relative to the peak of the whole spectrum, which may lie outside the wavelength grid;
    `refused`: name and reason of each spectrum that was left out. `peaks`: value of the file at the peak; l/(mol cm)
    for molar extinction.
    """

    names: tuple[str, ...]
    absorbance: Float[Array, "colorants wavelengths"]
    peaks: Float[Array, " colorants"]
    refused: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.names)

    @cached_property
    def numbers(self) -> dict[str, int]:
        """Number of each colorant in the catalog, from 1 on."""
        return {name: at for at, name in enumerate(self.names, 1)}


def modeled_colorants(grid: WavelengthGrid) -> Colorants:
    """Return modeled absorption bands with peaks at 560 to 700 nm and widths of 30, 40 and 50 nm.

    Gaussians in wavenumber (Siano and Metzler, J. Chem. Phys. 51, 1856, 1969), with widths in nm at the peak.
    """
    bands = [(float(peak), float(fwhm)) for peak in _PEAKS_NM for fwhm in _FWHM_NM]
    peak_nm, fwhm_nm = np.array(bands).T[:, :, None]
    shapes = np.exp(-GAUSSIAN * ((peak_nm / grid.nodes_nm - 1) * peak_nm / fwhm_nm) ** 2)
    names = tuple(f"modeled band {peak:g} nm, FWHM {fwhm:g} nm" for peak, fwhm in bands)
    return Colorants(names, shapes, np.ones(len(bands)))


def measured_films(grid: WavelengthGrid) -> Colorants:
    """Return measured films: rhodamine 6G, six conjugated polymers and a squaraine, none of them a color resist.

    4 pi k d / (ln 10 l), the absorbance of a pure film of d = 0.8 um, by the extinction coefficient k of light at
    normal incidence in the database refractiveindex.info (CC0): Seckin et al., ACS Appl. Mater. Interfaces 15, 43124,
    2023; Kamptner et al., ChemPhysChem, e202400233, 2024; Bernhardt et al., Aggregate, e698, 2024.
    """
    films = read_colorants([_FILMS], grid)
    return replace(films, names=tuple(name.removeprefix(f"{_FILMS.stem} ") for name in films.names))


def read_colorants(places: Sequence[Path], grid: WavelengthGrid) -> Colorants:
    """Read absorbances or molar extinctions of files, and of all files of folders in the order of their names.

    Negative values of up to 2 % of the peak become 0. A spectrum that ends inside the grid is 0 from there on, if it
    ends below 2 % of its peak.

    Raises DataError if no spectrum can be read, or there are more than 10,000.
    """
    names: list[str] = []
    rows: list[FloatArray] = []
    peaks: list[float] = []
    refused: list[str] = []
    notes: list[str] = []
    for file in [file for place in places for file in _files(place)]:
        try:
            curves = scan_curves(file)
        except DataError as error:
            refused.append(f"{file.name}: {error.issues[0].problem}")
            continue
        if not curves.names:
            refused.append(f"{file.name}: no curves")
        notes += [f"{file.name}: {note}" for note in curves.notes]
        wrong = {issue.key: issue.problem for group in curves.issues for issue in group}
        for name, unit, column in zip(curves.names, curves.units, curves.values.T, strict=True):
            known = np.isfinite(column)
            wave_nm, values = curves.wavelength_nm[known], column[known]
            own = file.stem if len(curves.names) == 1 else f"{file.stem} {name}"
            problem = wrong.get(name) or wrong.get(None) or _unsuitable(wave_nm, values, grid)
            if unit.quantity not in (None, "density"):
                problem = f"a column of {unit.quantity}, no absorbance"
            if own in names:
                problem = "a colorant of this name was read before"
            if problem:
                refused.append(f"{file.name}{'' if len(curves.names) == 1 else f' {name}'}: {problem}")
                continue
            peak = float(values.max())
            names.append(own)
            peaks.append(peak)
            rows.append(np.interp(grid.nodes_nm, wave_nm, values / peak, left=0.0, right=0.0))
    if not rows or len(rows) > _MOST_COLORANTS:
        problem = "no colorants" if not rows else "too many colorants"
        allowed = f"1 to {_MOST_COLORANTS:,} spectra of absorbance or molar extinction"
        raise DataError(ValidationIssue(problem, value="; ".join(refused[:3]) or None, allowed=allowed))
    return Colorants(tuple(names), np.stack(rows), np.array(peaks), tuple(refused), tuple(notes))


def _files(place: Path) -> list[Path]:
    """Return a file, or the files of curves in a folder."""
    if not place.is_dir():
        return [place]
    return sorted(file for file in place.iterdir() if file.is_file() and is_curve_file(file.name))


def _unsuitable(wave_nm: PerSample, values: PerSample, grid: WavelengthGrid) -> str:
    """Return why a spectrum is not taken; empty if it is."""
    peak = values.max(initial=0.0)
    if not peak > 0:
        return "it absorbs nothing"
    for end, inside in ((0, wave_nm[0] > grid.start_nm), (-1, wave_nm[-1] < grid.stop_nm)):
        if inside and values[end] > _END * peak:
            return f"it ends at {wave_nm[end]:g} nm with {values[end] / peak:.0%} of its peak"
    return ""


BUILTIN_COLORANTS = {"modeled": modeled_colorants, "films": measured_films}
"""Built-in catalogs by name."""
