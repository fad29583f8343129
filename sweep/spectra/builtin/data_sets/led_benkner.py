"""LEDs measured at TU Darmstadt (BSD-3): a green, two reds and a deep red of 660 nm; beside the amber of `luxeon`."""

from __future__ import annotations

from ...lights import Lights, make_lights
from ...spectrum import WavelengthGrid
from ..measured_sets import BENKNER, LUXEON

_AMBER = "amber_592"


def lights(grid: WavelengthGrid) -> Lights:
    """Return the LEDs, inside 400 to 700 nm."""
    amber = LUXEON.photons(grid)[_AMBER]
    signals = [(name, name.partition("_")[0], photons) for name, photons in BENKNER.photons(grid).items()]
    signals.insert(1, (_AMBER, "yellow", amber))
    return make_lights(grid, "led_benkner", signals, f"measured: {BENKNER.source}; amber: {LUXEON.source}")


def range_nm() -> tuple[float, float]:
    """Return the wavelengths that all have, nm."""
    return max(BENKNER.range_nm[0], LUXEON.range_nm[0]), min(BENKNER.range_nm[1], LUXEON.range_nm[1])
