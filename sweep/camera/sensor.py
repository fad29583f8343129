"""A sensor's QE curves on the wavelength grid."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from ..base.errors import DataError, ValidationIssue, nearest
from ..base.types import Array, Float, PerWavelength
from ..designs.technology import Technology
from ..spectra.builtin.ar0820 import ar0820, ir_cut_transmission
from ..spectra.builtin.measured_sets import SENSORS, WIDE, ir_cut
from ..spectra.builtin.surrogate import FITS, SurrogateParameters, surrogate_fit, surrogate_parameters
from ..spectra.spectrum import WavelengthGrid
from .mosaic import Mosaic

_LEAST_QE = 1e-9
"""A pixel that sees less would be exposed for hours on the sun."""
_CLEAR_NAMES = ("c", "w", "clear", "white", "mono", "panchromatic")
"""Names of a pixel without filter, in any case."""


@dataclass(frozen=True)
class SensorCurves:
    """QE curves of a sensor on the wavelength grid.

    `qe`: QE by curve name, electrons per photon, or on one common relative scale; `clear`: curve that the CFA
    sensitivity is relative to: the clear pixel, or the brightest curve; `surrogate`: True for modeled curves;
    `has_clear`: True if `clear` is a pixel without a filter. `variants`: for a CFA, channels that use a curve with
    another name. `ir_cut`: its transmission, where known; `bare`: the sensor without one that a study adds, and that.
    """

    name: str
    qe: Mapping[str, PerWavelength]
    clear: str
    source: str
    surrogate: bool = False
    variants: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    technologies: Mapping[str, Technology | None] = field(default_factory=dict)
    has_clear: bool = True
    ir_cut: PerWavelength | None = None
    bare: tuple[SensorCurves, PerWavelength] | None = None

    @property
    def brightest(self) -> str:
        """Name of the reference if it is only the brightest curve; empty if it is a clear pixel."""
        return "" if self.has_clear else self.clear

    def curve_name(self, cfa: str, channel: str) -> str:
        """Return the name of the curve of a channel."""
        return self.variants.get(cfa, {}).get(channel, channel)

    def curve(self, name: str) -> PerWavelength:
        """Return a curve.

        Raises DataError if there is no such curve, with the nearest name.
        """
        if name not in self.qe:
            known = list(self.qe)
            raise DataError(
                ValidationIssue(
                    "the sensor has no such curve",
                    value=name,
                    allowed=", ".join(known),
                    nearest=nearest(name, known),
                )
            )
        return self.qe[name]

    def mosaic_qe(
        self, mosaic: Mosaic, replaced: Mapping[str, str] | None = None
    ) -> Float[Array, "channels wavelengths"]:
        """Return the curves of a mosaic's channels.

        `replaced`: curve of channels that the sensor does not have (a modified channel and its base).
        """
        return np.stack([self.curve(name) for name in self.mosaic_curves(mosaic, replaced)])

    def mosaic_curves(self, mosaic: Mosaic, replaced: Mapping[str, str] | None = None) -> list[str]:
        """Return the names of the curves of a mosaic's channels.

        Returns names, one per channel.
        """
        names = {**{c: self.curve_name(mosaic.name, c) for c in mosaic.channels}, **(replaced or {})}
        return [names[channel] for channel in mosaic.channels]


def make_sensor(name: str, qe: Mapping[str, PerWavelength], source: str, clear: str | None = None) -> SensorCurves:
    """Make a sensor from curves on the grid.

    `clear`: clear pixel; left out, the curve with the largest sum, which is a clear pixel only if its name says so.
    Raises DataError if a QE exceeds 1 or is below 1e-9 everywhere, or if `clear` is no curve.
    """
    issues = []
    for curve, values in qe.items():
        top = float(values.max())
        if not top <= 1 + 1e-9:
            hint = "looks like percent: set `scale: 0.01`" if top <= 100 else "set `scale`"
            issues.append(ValidationIssue(f"QE above 1 ({hint})", source, None, curve, round(top, 6), "0 to 1"))
        if not top >= _LEAST_QE:
            what = "0" if top == 0 else f"below {_LEAST_QE:g}"
            issues.append(ValidationIssue(f"QE is {what} on the whole grid", source, None, curve))
    if issues:
        raise DataError(issues)
    chosen = clear or max(qe, key=lambda curve: float(qe[curve].sum()))
    has_clear = clear is not None or chosen.casefold() in _CLEAR_NAMES
    sensor = SensorCurves(name, dict(qe), chosen, source, has_clear=has_clear)
    sensor.curve(chosen)
    return sensor


def own_red(names: Collection[str]) -> dict[str, dict[str, str]]:
    """Return the channels that have another curve in some CFAs: CFA -> channel -> curve.

    RCCC and RCCB have a red of their own, where a sensor has one; the clear pixels of RGBW4x4 may be named C.
    """
    red = {cfa: {"R": "Rx"} for cfa in ("RCCC", "RCCB")} if "Rx" in names else {}
    return red | ({"RGBW4x4": {"W": "C"}} if "C" in names and "W" not in names else {})


def ar0820_sensor(grid: WavelengthGrid, parameters: SurrogateParameters) -> SensorCurves:
    """Make the surrogate sensor from its parameters; RCCC and RCCB have a red of their own."""
    curves = ar0820(grid, parameters)
    cut = ir_cut_transmission(grid.nodes_nm, parameters)
    variants = own_red(curves.values)
    return SensorCurves("ar0820", curves.values, "C", curves.source, True, variants, ir_cut=cut)


def _sensor_of_fit(number: int, grid: WavelengthGrid) -> SensorCurves:
    return replace(ar0820_sensor(grid, surrogate_fit(number)), name=f"ar0820@{number}")


def measured_sensor(name: str, grid: WavelengthGrid) -> SensorCurves:
    """Make a measured sensor that the package ships.

    Raises DataError if the grid goes beyond the curves. RCCC and RCCB have a red of their own where it was measured.
    """
    measured = SENSORS[name]
    curves = measured.curves(grid)
    source = f"built-in {name}: {measured.source}"
    known = [channel for channel in ("W", "C") if channel in curves]
    clear = known[0] if known else max(curves.keys() - WIDE.keys(), key=lambda channel: float(curves[channel].sum()))
    variants, cut = own_red(curves), ir_cut(name, grid)
    return SensorCurves(name, curves, clear, source, variants=variants, has_clear=bool(known), ir_cut=cut)


BUILT_IN_SENSORS: dict[str, Callable[[WavelengthGrid], SensorCurves]] = {
    "ar0820": lambda grid: ar0820_sensor(grid, surrogate_parameters()),
    **{f"ar0820@{number}": partial(_sensor_of_fit, number) for number in range(1, FITS + 1)},
    **{name: partial(measured_sensor, name) for name in SENSORS},
}
"""Sensors that a study can name; each is a function of the wavelength grid (inside 400-700 nm)."""
