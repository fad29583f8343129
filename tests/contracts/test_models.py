"""Mosaics, metrics, sensor, geometry, edges, families: small models against closed forms and brute force."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sweep.base.errors import SweepError
from sweep.camera.camera import Camera
from sweep.camera.model import SceneModel
from sweep.camera.mosaic import Mosaic
from sweep.camera.pixel import Optics, Pixel, irradiance_factor
from sweep.camera.readout import rounded
from sweep.camera.scene import FixedExposure, Geometry, Scene
from sweep.camera.setup import Setup
from sweep.designs.edge import SPAN_PER_WIDTH, edge, edge_gradient
from sweep.designs.families.stopband import Stopband
from sweep.metrics.pareto import non_dominated
from sweep.metrics.separation import cfa_sensitivity, separation
from sweep.spectra.lights import Lights
from sweep.spectra.spectrum import WavelengthGrid


@pytest.mark.parametrize(
    ("name", "channels", "counts"),
    [
        ("RGGB", "R G B", [1, 2, 1]),
        ("RCCC", "R C", [1, 3]),
        ("RYNCy", "R Y N Cy", [1, 1, 1, 1]),
    ],
)
def test_channels_count_once(name: str, channels: str, counts: list[int]) -> None:
    mosaic = Mosaic.from_name(name)
    assert mosaic.channels == tuple(channels.split())
    assert list(mosaic.counts) == counts


def test_any_tile() -> None:
    rows = [["R", "G", "R"], ["G", "B", "W"]]
    mosaic = Mosaic.from_rows("mine", rows)
    assert [[mosaic.channels[i] for i in row] for row in mosaic.indices] == rows
    for bad in ("RGB", "rggb", "RGGBB", "R-GB", ""):
        with pytest.raises(SweepError, match="2x2"):
            Mosaic.from_name(bad)
    for ragged in ([], [[]], [["R"], ["G", "B"]]):
        with pytest.raises(SweepError, match="equal length"):
            Mosaic.from_rows("ragged", ragged)


def test_separation_of_near_points_at_a_large_offset() -> None:
    # 1e8 + 2^-20 is exact in float64, so the distance is exactly 2^-20 sqrt(2).
    near = np.array([[[1e8, 1e8], [1e8 + 2.0**-20, 1e8 - 2.0**-20]]])
    found = separation(near, np.array([0]), np.array([1]))[0]
    assert found == pytest.approx(2.0**-20 * math.sqrt(2), rel=1e-15)


def test_sensitivities() -> None:
    total_qe = np.array([0.1 + 0.1, 0.5 + 0.3])
    # one pixel of the first, three of the second: (0.2 + 3 * 0.8) / 4 = 0.65 over 1.3
    assert cfa_sensitivity(total_qe, np.array([1, 3]), np.array([0.6, 0.7])) == pytest.approx(0.5, rel=1e-15)


def test_non_dominated_keeps_ties_and_skips_nan() -> None:
    values = np.array([[1, 2], [2, 1], [1, 1], [2, 1], [np.nan, 9], [9, 9]], dtype=float)
    eligible = np.array([True] * 5 + [False])
    assert list(non_dominated(values, eligible)) == [True, True, False, True, False, False]
    assert not non_dominated(np.empty((0, 2))).any()
    assert not non_dominated(np.full((3, 2), np.nan)).any()


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1), st.integers(1, 60))
def test_non_dominated_is_the_definition(seed: int, n: int) -> None:
    values = np.random.default_rng(seed).integers(0, 8, (n, 2)).astype(float)
    brute = [not any((o >= v).all() and (o > v).any() for o in values) for v in values]
    assert list(non_dominated(values)) == brute


def test_irradiance_is_the_camera_equation() -> None:
    assert irradiance_factor(Optics(f_number=4)) == pytest.approx(math.pi / 65, rel=1e-15)
    assert irradiance_factor(Optics(f_number=4), magnification=-1) == pytest.approx(math.pi / 257, rel=1e-15)
    assert irradiance_factor(Optics(f_number=2, transmission=0.5)) == pytest.approx(0.5 * math.pi / 17, rel=1e-12)


def test_electrons_of_a_flat_light() -> None:
    pixel = Pixel(pitch_um=2.0, fill_factor=0.5)
    qe = np.full((2, 301), 0.25)
    grid, factor = WavelengthGrid(), irradiance_factor(Optics())
    light = Lights("flat", ("flat",), ("flat",), np.full((1, 301), 1 / 301), 1.0, "", True)
    scenario = Scene(photon_radiance=1e15 * 301 / factor, exposure=FixedExposure(exposure_s=1.0))
    setup = Setup(Camera(grid, Mosaic.from_rows("RB", [["R", "B"]]), qe, (), qe[0], pixel), light, scenario)
    rate = next(SceneModel(setup).views()).electrons.rates(np.empty((1, 0, 301)))
    # 1e15 photons/s/m^2/nm x 301 nm x 0.25 x 2e-12 m^2
    np.testing.assert_allclose(rate, 1e15 * 301 * 0.25 * 2e-12, rtol=1e-13)


def read_out(electrons: np.ndarray, pixel: Pixel) -> np.ndarray:
    return rounded(np.minimum(electrons, pixel.saturation_e) * pixel.dn_per_e, pixel)


def test_digital_numbers_clip_the_well_before_the_adc() -> None:
    pixel = Pixel(well_e=1000.0, gain_dn_per_e=2.0, offset_dn=100.0)
    electrons = np.array([0, 0.24, 0.25, 1.0, 999.0, 5000.0, np.inf])
    np.testing.assert_array_equal(read_out(electrons, pixel), [100, 100, 101, 102, 2098, 2100, 2100])
    full = Pixel()
    np.testing.assert_array_equal(read_out(np.array([0.0, 1e4, 1e9]), full), [0, 4095, 4095])
    loud = Pixel(gain_dn_per_e=1.0)
    np.testing.assert_array_equal(read_out(np.array([4095.4, 4096.0]), loud), [4095, 4095])


@pytest.mark.parametrize(("distance_m", "fov_deg", "printed"), [(20, 120, "18"), (100, 60, "7.3"), (250, 30, "5.9")])
def test_object_resolution_of_the_papers_table_1(distance_m: float, fov_deg: float, printed: str) -> None:
    found = Geometry(distance_m=distance_m, fov_deg=fov_deg).object_resolution_px
    assert f"{found:.2g}" == printed


def test_edge_spans_10_to_90_percent_within_its_width() -> None:
    center, width = np.array(600.0), np.array(20.0)
    np.testing.assert_allclose(edge(np.array([590.0, 600.0, 610.0]), center, width), [0.1, 0.5, 0.9], rtol=1e-12)
    outside = np.array([600 - 10 * SPAN_PER_WIDTH, 600 + 10 * SPAN_PER_WIDTH])
    assert list(edge(outside, center, width)) == [0, 1]


@pytest.mark.parametrize("width", [0.0, 5e-324, 1e-300])
def test_edge_without_width_is_a_brick_wall(width: float) -> None:
    found = edge(np.array([599.0, 600.0, 601.0]), np.array(600.0), np.array(width))
    assert list(found) == [0, 0.5, 1]
    assert all(np.isfinite(g).all() for g in edge_gradient(np.array([599.0, 600.0]), np.array(600.0), np.array(width)))


WAVE = np.arange(400.0, 701.0)
BASE = 0.3 + 0.5 / (1 + np.exp(-(WAVE - 500) / 20))
TARGET = 0.2 + 0.1 * np.sin(WAVE / 40)


def test_crossed_edges_are_a_violation() -> None:
    family = Stopband(WAVE, BASE, TARGET)
    good, crossed, wide = [600, 10, 640, 10, 1], [640, 10, 600, 10, 1], [600, 200, 610, 10, 1]
    assert list((family.violation(np.array([good, crossed, wide], dtype=float)) <= 0).all(axis=1)) == [
        True,
        False,
        False,
    ]
