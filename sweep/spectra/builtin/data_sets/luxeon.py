"""Luxeon Rebel LEDs, measured (ISETCam, MIT): two green, one yellow (amber) and two red."""

from __future__ import annotations

from ...lights import Lights, make_lights
from ...spectrum import WavelengthGrid
from ..measured_sets import LUXEON

_TYPES = {
    "cyan_504": "green",
    "green_528": "green",
    "amber_592": "yellow",
    "red_orange_632": "red",
    "red_642": "red",
}


def lights(grid: WavelengthGrid) -> Lights:
    """Return the LEDs.

    `grid`: wavelengths inside 400 to 700 nm.
    """
    signals = [(name, _TYPES[name], photons) for name, photons in LUXEON.photons(grid).items()]
    return make_lights(grid, "luxeon", signals, f"built-in luxeon, measured: {LUXEON.source}")


def range_nm() -> tuple[float, float]:
    """Return the wavelengths that all have, nm."""
    return LUXEON.range_nm
