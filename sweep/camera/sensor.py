"""A sensor's QE curves on the wavelength grid."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from ..base.errors import DataError, Fault, nearest
from ..base.types import FloatArray
from ..curves.builtin.ar0820 import ar0820
from ..curves.builtin.surrogate import SurrogateParameters, surrogate_parameters
from ..curves.spectrum import WavelengthGrid
from ..designs.technology import Technology
from .mosaic import Mosaic

_LEAST_QE = 1e-9
"""A pixel that sees less would be exposed for hours on the sun."""
_CLEAR_NAMES = ("c", "w", "clear", "white", "mono", "panchromatic")
"""Names of a pixel without filter, in any case."""


@dataclass(frozen=True)
class SensorCurves:
    """QE by curve name, each ndarray[n_wavelengths], electrons per photon (or on one common relative scale).

    `clear` names the reference of the CFA's sensitivity: a pixel without filter where `has_clear`, else the brightest
    curve. `variants` maps a CFA's name to channels of it that use a
    curve of another name. `technologies`: by what the filters of curves work, where that is stated.
    """

    name: str
    qe: Mapping[str, FloatArray]
    clear: str
    source: str
    surrogate: bool = False
    variants: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    technologies: Mapping[str, Technology | None] = field(default_factory=dict)
    has_clear: bool = True

    @property
    def brightest(self) -> str:
        """The reference where that is only the brightest curve; empty where it is a pixel without filter."""
        return "" if self.has_clear else self.clear

    def curve_name(self, cfa: str, channel: str) -> str:
        """The curve that `channel` of `cfa` uses."""
        return self.variants.get(cfa, {}).get(channel, channel)

    def curve(self, name: str) -> FloatArray:
        """A curve by its name, ndarray[n_wavelengths]; raises DataError with the nearest name when there is none."""
        if name not in self.qe:
            known = list(self.qe)
            raise DataError(
                Fault(
                    "the sensor has no such curve",
                    value=name,
                    allowed=", ".join(known),
                    nearest=nearest(name, known),
                )
            )
        return self.qe[name]

    def mosaic_qe(self, mosaic: Mosaic, replaced: Mapping[str, str] | None = None) -> FloatArray:
        """Curves of the mosaic's channels, ndarray[n_channels, n_wavelengths].

        `replaced` names the curve of channels that the sensor does not have itself (a modified channel and its base).
        """
        return np.stack([self.curve(name) for name in self.mosaic_curves(mosaic, replaced)])

    def mosaic_curves(self, mosaic: Mosaic, replaced: Mapping[str, str] | None = None) -> list[str]:
        """The names of these curves."""
        names = {**{c: self.curve_name(mosaic.name, c) for c in mosaic.channels}, **(replaced or {})}
        return [names[channel] for channel in mosaic.channels]


def make_sensor(name: str, qe: Mapping[str, FloatArray], source: str, clear: str | None = None) -> SensorCurves:
    """A sensor from curves on the grid; `clear` defaults to the curve with the largest total.

    That one counts as a pixel without filter only where its name says so.
    Raises DataError when a QE is above 1 or below 1e-9 everywhere, or `clear` is not a curve.
    """
    faults = []
    for curve, values in qe.items():
        top = float(values.max())
        if not top <= 1 + 1e-9:
            hint = "looks like percent: set `scale: 0.01`" if top <= 100 else "set `scale`"
            faults.append(Fault(f"QE above 1 ({hint})", source, None, curve, round(top, 6), "0 to 1"))
        if not top >= _LEAST_QE:
            what = "0" if top == 0 else f"below {_LEAST_QE:g}"
            faults.append(Fault(f"QE is {what} on the whole grid", source, None, curve))
    if faults:
        raise DataError(faults)
    chosen = clear or max(qe, key=lambda curve: float(qe[curve].sum()))
    has_clear = clear is not None or chosen.casefold() in _CLEAR_NAMES
    sensor = SensorCurves(name, dict(qe), chosen, source, has_clear=has_clear)
    sensor.curve(chosen)
    return sensor


def ar0820_sensor(grid: WavelengthGrid, parameters: SurrogateParameters) -> SensorCurves:
    """The surrogate sensor from its parameters; RCCC and RCCB have a red of their own."""
    curves = ar0820(grid, parameters)
    red = {"R": "Rx"}
    return SensorCurves("ar0820", curves.values, "C", curves.source, True, {"RCCC": red, "RCCB": red})


BUILT_IN_SENSORS: dict[str, Callable[[WavelengthGrid], SensorCurves]] = {
    "ar0820": lambda grid: ar0820_sensor(grid, surrogate_parameters())
}
"""Sensors that a study can name; each is a function of the wavelength grid (inside 400-700 nm)."""
