"""Measured sensors and lights that the package ships, with source and license; see `measured/README.md`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from ...base.types import PerWavelength
from ..formats import digest, read_curves
from ..spectrum import Curves, WavelengthGrid, photons_from_energy

_FOLDER = Path(__file__).parent / "measured"
WIDE = {"Wide": "R + G + B, its largest value set to 1", "Wsum": "R + G + B"}
"""Pixels without a color filter, modeled for cameras of three measured channels; their scale is not known."""
_ISETCAM = "ISETCam, https://github.com/ISET/isetcam"


@dataclass(frozen=True)
class MeasuredFile:
    """File of curves.

    `times`: column that multiplies all others; empty if none does. `per_energy`: responses to power, not to photons,
    each set to a largest QE of 1.
    """

    file: str
    columns: Mapping[str, str]
    scale: float = 1.0
    times: str = ""
    per_energy: bool = False

    @property
    def raw(self) -> Curves:
        """Curves of the file."""
        return _read(self.file)

    def on(self, grid: WavelengthGrid) -> dict[str, PerWavelength]:
        """Return the curves on a grid, photons to electrons."""
        raw, factor = self.raw, np.full(grid.size, self.scale)
        if self.times:
            factor = factor * raw.on(grid, self.times)
        if self.per_energy:
            top = max(
                float((raw.samples(column)[1] / raw.samples(column)[0]).max()) for column in self.columns.values()
            )
            factor = factor / (grid.nodes_nm * top)
        return {name: raw.on(grid, column) * factor for name, column in self.columns.items()}


@dataclass(frozen=True)
class MeasuredSet:
    """Sensor or set of lights with its origin; `wide`: with modeled pixels without a color filter (`WIDE`)."""

    what: str
    source: str
    license: str
    files: tuple[MeasuredFile, ...]
    wide: bool = False

    @property
    def range_nm(self) -> tuple[float, float]:
        """Wavelengths that all curves have, nm."""
        ends = [file.raw.wavelength_nm[[0, -1]] for file in self.files]
        return float(max(low for low, _ in ends)), float(min(high for _, high in ends))

    @property
    def names(self) -> list[str]:
        """Curves."""
        return [*(name for file in self.files for name in file.columns), *(WIDE if self.wide else ())]

    def curves(self, grid: WavelengthGrid) -> dict[str, PerWavelength]:
        """Return the curves on a grid.

        Raises DataError if the grid goes beyond.
        """
        curves = {name: curve for file in self.files for name, curve in file.on(grid).items()}
        if self.wide:
            together, (low, high) = np.sum(list(curves.values()), axis=0), self.range_nm
            whole = WavelengthGrid(start_nm=low, stop_nm=high)
            top = np.sum([curve for file in self.files for curve in file.on(whole).values()], axis=0).max()
            curves |= dict(zip(WIDE, (together / top, together), strict=True))
        return curves

    def photons(self, grid: WavelengthGrid) -> dict[str, PerWavelength]:
        """Return photons of spectra of radiant power."""
        return {name: photons_from_energy(grid.nodes_nm, energy) for name, energy in self.curves(grid).items()}

    @property
    def digests(self) -> dict[str, str]:
        """SHA-256 of each file."""
        return {file.file: digest(_FOLDER / file.file) for file in self.files}


@lru_cache(maxsize=16)
def _read(file: str) -> Curves:
    return read_curves(_FOLDER / file)


_RGBW = {"R": "R", "G": "G", "B": "B", "W": "W"}
_RCCC = {"Rx": "R", "C": "C"}
IR_CUT = "ir_cut"
SENSORS: dict[str, MeasuredSet] = {
    "opencam": MeasuredSet(
        "a sensor of unknown name with red, green, blue, yellow, cyan and clear pixels behind an IR cut: QE, digitized",
        "open-cam, spectra/QE/original, 2026",
        "MIT",
        (MeasuredFile("qe_opencam.csv", {**{n: n for n in ("R", "G", "B", "Y", "Cy")}, "C": "W"}, times=IR_CUT),),
    ),
    "ar0132at": MeasuredSet(
        "ON Semiconductor AR0132AT, without IR cut: relative QE, digitized from its data sheet",
        _ISETCAM,
        "MIT",
        # Normalized apart; brought to the same clear pixel at 630 nm.
        (MeasuredFile("qe_ar0132at_rgbw.csv", _RGBW), MeasuredFile("qe_ar0132at_rccc.csv", _RCCC, 0.9445)),
    ),
    "mt9v024": MeasuredSet(
        "ON Semiconductor MT9V024, without IR cut: QE, digitized from its data sheet",
        _ISETCAM,
        "MIT",
        (MeasuredFile("qe_mt9v024_rgbw.csv", _RGBW), MeasuredFile("qe_mt9v024_rccc.csv", _RCCC)),
    ),
}
"""Sensors by name; `C` is the pixel without a filter, `Rx` the red of RCCC."""
RAWTOACES = "rawtoaces"
_CAMERAS = "rawtoaces_cameras.csv"
with (_FOLDER / _CAMERAS).open(encoding="utf-8") as _lines:
    _NAMES = dict.fromkeys(column.partition(":")[0] for column in next(_lines).strip().split(",")[1:])
SENSORS |= {
    f"{RAWTOACES}/{name}": MeasuredSet(
        f"{name.replace('_', ' ')} behind its own IR cut: response to power, relative, measured with a monochromator; "
        f"modeled: {'; '.join(f'{curve} = {how}' for curve, how in WIDE.items())}",
        "rawtoaces-data of the Academy Software Foundation, joined to one file and rounded to five digits",
        "Apache-2.0",
        (MeasuredFile(_CAMERAS, {channel: f"{name}:{channel}" for channel in "RGB"}, per_energy=True),),
        wide=True,
    )
    for name in _NAMES
}
BENKNER = MeasuredSet(
    "measured LEDs: one green, two red and a deep red of 660 nm, as lights beside the amber of luxeon (400 to 700 nm)",
    "SBenkner/Spectral-Fitting, TU Darmstadt (doi:10.1109/ACCESS.2022.3197280), resampled to 1 nm",
    "BSD-3",
    (MeasuredFile("led_benkner.csv", {n: n for n in ("green_1", "red_1", "red_2", "red_3")}),),
)
LUXEON = MeasuredSet(
    "five Luxeon Rebel LEDs as green, yellow and red lights: relative spectral power, measured",
    _ISETCAM,
    "MIT",
    (
        MeasuredFile(
            "led_luxeon.csv", {n: n for n in ("cyan_504", "green_528", "amber_592", "red_orange_632", "red_642")}
        ),
    ),
)


def ir_cut(name: str, grid: WavelengthGrid) -> PerWavelength | None:
    """Return the transmission of a sensor's IR cut.

    None if it has none.
    """
    file = SENSORS[name].files[0]
    return file.raw.on(grid, file.times) if file.times else None
