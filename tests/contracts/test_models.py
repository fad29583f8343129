"""Mosaics, fronts, irradiance, edges: small models against closed forms and brute force."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sweep.base.errors import SweepError
from sweep.camera.mosaic import Mosaic
from sweep.camera.pixel import Optics, irradiance_factor
from sweep.designs.edge import edge_gradient
from sweep.metrics.pareto import non_dominated


def test_what_is_no_tile_is_refused() -> None:
    for bad in ("RGB", "rggb", "RGGBB", "R-GB", ""):
        with pytest.raises(SweepError, match="2x2"):
            Mosaic.from_name(bad)
    for ragged in ([], [[]], [["R"], ["G", "B"]]):
        with pytest.raises(SweepError, match="equal length"):
            Mosaic.from_rows("ragged", ragged)


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
    assert irradiance_factor(Optics(f_number=4), magnification=-1) == pytest.approx(math.pi / 257, rel=1e-15)
    assert irradiance_factor(Optics(f_number=2, transmission=0.5)) == pytest.approx(0.5 * math.pi / 17, rel=1e-12)


@pytest.mark.parametrize("width", [0.0, 5e-324, 1e-300])
def test_an_edge_without_width_has_finite_slopes(width: float) -> None:
    assert all(np.isfinite(g).all() for g in edge_gradient(np.array([599.0, 600.0]), np.array(600.0), np.array(width)))
