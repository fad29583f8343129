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
from sweep.camera.scene import FixedExposure, Scene
from sweep.camera.setup import Setup
from sweep.designs.edge import edge, edge_gradient
from sweep.designs.families.stopband import Stopband
from sweep.metrics.pareto import non_dominated
from sweep.metrics.separation import separation
from sweep.spectra.lights import Lights
from sweep.spectra.spectrum import WavelengthGrid


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


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1), st.integers(0, 60))
def test_non_dominated_is_the_definition(seed: int, n: int) -> None:
    """With ties, unknown values and designs that are not eligible."""
    rng = np.random.default_rng(seed)
    values = rng.choice([*range(8), np.nan], (n, 2))
    held = (rng.random(n) < 0.8) & ~np.isnan(values).any(axis=1)
    better = [any((o >= v).all() and (o > v).any() for o in values[held]) for v in values]
    eligible = held | np.isnan(values).any(axis=1)
    assert list(non_dominated(values, eligible)) == [*(held & ~np.array(better, dtype=bool))]


def test_irradiance_is_the_camera_equation() -> None:
    assert irradiance_factor(Optics(f_number=4)) == pytest.approx(math.pi / 65, rel=1e-15)
    assert irradiance_factor(Optics(f_number=4), magnification=-1) == pytest.approx(math.pi / 257, rel=1e-15)
    assert irradiance_factor(Optics(f_number=2, transmission=0.5)) == pytest.approx(0.5 * math.pi / 17, rel=1e-12)


def test_electrons_of_a_flat_light() -> None:
    pixel = Pixel(pitch_um=2.0, fill_factor=0.5)
    qe = np.full((2, 301), 0.25)
    grid, factor = WavelengthGrid(), irradiance_factor(Optics())
    light = Lights("flat", ("flat",), ("flat",), np.full((1, 301), 1 / 300), 1.0, "", True)
    scenario = Scene(photon_radiance=1e15 * 300 / factor, exposure=FixedExposure(exposure_s=1.0))
    setup = Setup(Camera(grid, Mosaic.from_rows("RB", [["R", "B"]]), qe, (), qe[0], pixel), light, scenario)
    rate = next(SceneModel(setup).views()).electrons.rates(np.empty((1, 0, 301)))
    # 1e15 photons/s/m^2/nm x 300 nm x 0.25 x 2e-12 m^2
    np.testing.assert_allclose(rate, 1e15 * 300 * 0.25 * 2e-12, rtol=1e-13)


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
