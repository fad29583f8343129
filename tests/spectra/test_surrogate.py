"""The built-in sensor and lights: complete, physical, and marked as what they are."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import PchipInterpolator

from sweep.camera.sensor import BUILT_IN_SENSORS
from sweep.spectra.builtin.ar0820 import monotone
from sweep.spectra.builtin.led import led_photons
from sweep.spectra.builtin.registry import BUILT_IN_LIGHTS
from sweep.spectra.lights import peak_normalized_ratio
from sweep.spectra.spectrum import WavelengthGrid

from ..rounding import gamma

GRID = WavelengthGrid()
SENSOR = BUILT_IN_SENSORS["ar0820"](GRID)
LIGHTS = BUILT_IN_LIGHTS["tl16"](GRID)


def test_51_signals_of_16_lights() -> None:
    assert LIGHTS.classes == ("green", "yellow", "orange", "red")
    assert [len(index) for index in LIGHTS.members.values()] == [16, 16, 3, 16]
    assert len(set(LIGHTS.names)) == 51
    assert LIGHTS.surrogate
    np.testing.assert_allclose(GRID.integrate(LIGHTS.photons), 1, rtol=gamma(GRID.size + 2))


def test_channels_are_physical() -> None:
    assert set(SENSOR.qe) == {"R", "G", "B", "C", "Y", "Cy", "Rx"}
    assert SENSOR.surrogate
    clear = SENSOR.qe["C"]
    for curve in SENSOR.qe.values():
        assert ((curve >= 0) & (curve <= 1)).all()
        assert (curve <= clear + 1e-12).all()


def test_led_shape_peaks_at_one_and_decays_exponentially() -> None:
    wave = np.array([0.0, 1.0, 600.0, 900.0, 901.0])
    blue, red = 8.0, 5.0
    found = led_photons(wave, 600.0, blue, red)
    assert found[2] == 1
    assert found[1] / found[0] == pytest.approx(np.exp(1 / blue), rel=1e-12)
    assert found[4] / found[3] == pytest.approx(np.exp(-1 / red), rel=1e-12)
    assert (led_photons(np.array([1.0, 1e5]), 600.0, 0.1, 0.1) >= 0).all()


def test_photon_ratio_of_peak_normalized_boxes() -> None:
    boxes = np.zeros((3, 301))
    for row, width in enumerate((20, 30, 70)):
        boxes[row, 100 : 100 + width] = 7.0
    assert peak_normalized_ratio(GRID, boxes) == pytest.approx(30 / 300, rel=1e-14)


@given(st.lists(st.tuples(st.floats(0.5, 90), st.floats(0, 1)), min_size=3, max_size=12), st.integers(0, 3))
def test_the_monotone_cubic_is_the_one_of_scipy(steps: list[tuple[float, float]], digits: int) -> None:
    nodes = 380 + np.cumsum([step for step, _ in steps])
    values = np.round([value for _, value in steps], digits)  # some are alike, where it is flat
    wanted = np.linspace(nodes[0], nodes[-1], 301)
    with np.errstate(all="ignore"):  # SciPy divides by rises that are none
        expected = PchipInterpolator(nodes, values)(wanted)
    np.testing.assert_allclose(monotone(nodes, values, wanted), expected, rtol=0, atol=4 * np.finfo(float).eps)
