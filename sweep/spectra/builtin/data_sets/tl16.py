"""Surrogate of the paper's 16 traffic lights from stated parameters; not measured.

11 lamps in California and 5 in Munich, each green, yellow and red; 3 of the US ones show an orange "don't walk", too:
16 + 16 + 16 + 3 = 51 signals.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ....base.types import PerWavelength
from ...lights import Lights, make_lights
from ...spectrum import WavelengthGrid
from ..led import led_photons
from ..surrogate import BUILT_IN_RANGE_NM, SurrogateParameters, surrogate_fit, surrogate_parameters

LAMPS = {"us": 11, "germany": 5}
ORANGE_LAMPS = {"us": 3}
SIGNAL_TYPES = ("green", "yellow", "orange", "red")


def tl16(grid: WavelengthGrid, parameters: SurrogateParameters) -> Lights:
    """Return the 51 signals; the lamps of a region spread evenly over peak +- spread of each color."""
    wave = grid.nodes_nm
    signals = []
    for color in SIGNAL_TYPES:
        for region, lamps in (ORANGE_LAMPS if color == "orange" else LAMPS).items():
            led = parameters.lights[region][color]
            for lamp, offset in enumerate(np.linspace(-1.0, 1.0, lamps)):
                spectrum = led_photons(wave, led.peak_nm + offset * led.spread_nm, led.blue_nm, led.red_nm)
                signals.append((f"{region}_{lamp + 1:02d}_{color}", color, spectrum))
    return make_lights(
        grid, "tl16", signals, "built-in surrogate tl16", photon_ratio=parameters.photon_ratio, surrogate=True
    )


def red_led(region: str, wavelength_nm: PerWavelength, peak_nm: float) -> PerWavelength:
    """Return the photon spectrum of a red LED of a region's shape at another peak, 1 there."""
    led = surrogate_parameters().lights[region]["red"]
    return led_photons(wavelength_nm, peak_nm, led.blue_nm, led.red_nm)


def lights(grid: WavelengthGrid) -> Lights:
    """Return the signals of `tl16` with the package's parameters."""
    return tl16(grid, surrogate_parameters())


def tl16_of_fit(number: int, grid: WavelengthGrid) -> Lights:
    """Return the signals with the parameters of another fit."""
    return replace(tl16(grid, surrogate_fit(number)), name=f"tl16@{number}")


def range_nm() -> tuple[float, float]:
    """Return the wavelengths that all have, nm."""
    return BUILT_IN_RANGE_NM
