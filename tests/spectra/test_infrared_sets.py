"""Near infrared and measured sets: modeled filament signals, measured LEDs and wide pixels."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from scipy.integrate import trapezoid

from sweep.camera.sensor import BUILT_IN_SENSORS
from sweep.spectra.builtin.registry import BUILT_IN_LIGHTS
from sweep.spectra.color import REGIONS, chromaticity
from sweep.spectra.signal_color import VISIBLE, light_color
from sweep.spectra.spectrum import WavelengthGrid

MEASURED = Path(__file__).parents[2] / "sweep" / "spectra" / "builtin" / "measured"


def test_filament_signals_have_the_colors_of_the_norm_and_planck_s_infrared() -> None:
    grid = WavelengthGrid(start_nm=380, stop_nm=1080, step_nm=1)
    lights = BUILT_IN_LIGHTS["filament"](grid)
    for kind, xy in zip(lights.types, chromaticity(grid, lights.photons), strict=True):
        assert REGIONS[kind].violation(xy[None])[0] <= 0
    wave = grid.nodes_nm
    photons = wave**-4 / np.expm1(6.62607015e-34 * 299792458 / (wave * 1e-9 * 1.380649e-23 * 2856))
    behind = lights.photons[lights.names.index("red_2856K")]
    clear = wave > 850
    np.testing.assert_allclose(behind[clear] / behind[-1], photons[clear] / photons[-1], rtol=1e-4)


def test_measured_leds_are_those_of_their_file() -> None:
    grid = WavelengthGrid()
    lights = BUILT_IN_LIGHTS["led_benkner"](grid)
    raw = pd.read_csv(MEASURED / "led_benkner.csv").set_index("wavelength_nm").loc[grid.nodes_nm]
    for name in ("green_1", "red_1", "red_2", "red_3"):
        photons = raw[name].to_numpy() * grid.nodes_nm
        np.testing.assert_allclose(lights.photons[lights.names.index(name)], photons / trapezoid(photons), rtol=1e-12)


def test_a_green_lamp_may_have_the_color_of_a_marker_lamp() -> None:
    """Monochromatic light by the CIE's table: greens of EN 12368 from 495 to 498 nm are blue-green of J578, too."""
    cie = pd.read_csv(MEASURED.parent / "cie_1931.csv", header=None, skiprows=1).to_numpy()
    both = []
    for nm, *xyz in cie[:, :4]:
        x, y = (value / sum(xyz) for value in xyz[:2])
        green = y <= 0.726 - 0.726 * x and x <= 0.625 * y - 0.041 and y >= 0.4
        photons = (VISIBLE.nodes_nm == nm).astype(float)
        color = light_color(photons)
        assert color is not None
        assert (color.region == "green") == green
        assert bool(color.markers) == (y <= 0.5 - 0.5 * x and x <= 0.2 and y >= 0.32)
        both += [nm] * bool(green and color.markers)
    assert (min(both), max(both)) == (495, 498)


def test_wide_pixels_are_the_sum_of_measured_ones() -> None:
    grid = WavelengthGrid(step_nm=5)
    sensor = BUILT_IN_SENSORS["rawtoaces/Canon_EOS_5D"](grid)
    total = sum(sensor.qe[channel] for channel in "RGB")
    np.testing.assert_allclose(sensor.qe["Wsum"], total, rtol=1e-14)
    raw, wave = pd.read_csv(MEASURED / "rawtoaces_cameras.csv"), np.arange(380.0, 781)
    measured = [np.interp(wave, raw["wavelength_nm"], raw[f"Canon_EOS_5D:{channel}"]) / wave for channel in "RGB"]
    unscaled = np.sum(measured, axis=0)
    there = np.interp(grid.nodes_nm, wave, unscaled)
    np.testing.assert_allclose(sensor.qe["Wide"], there / unscaled.max(), rtol=1e-6)
