"""Where the light's center falls on the mosaic."""

from __future__ import annotations

import numpy as np

from ..arrays import FloatArray, IndexArray
from ..setup import Setup

METHODS = ("one", "pixel", "half pixel", "quarter pixel")
_PER_PIXEL = {"one": 0, "pixel": 1, "half pixel": 2, "quarter pixel": 4}


def skip_is_exact(setup: Setup) -> str | None:
    """Why one place is enough; None when the scene asks for all."""
    target = setup.scenario.target
    if target is None:
        return "a patch that fills the field"
    return None if target.phase_px == "any" else "the scene names the place"


def places_px(setup: Setup, method: str) -> FloatArray:
    """Centers of the light, ndarray[n_cases, 2] as (column, row): all of a grid over the tile, or the scene's one."""
    target = setup.scenario.target
    rows, columns = setup.mosaic.indices.shape
    if target is None:
        return np.zeros((1, 2))
    if target.phase_px != "any":
        return np.asarray(np.mod([target.phase_px], (columns, rows)), dtype=float)
    per_pixel = _PER_PIXEL[method]
    if not per_pixel:
        return np.zeros((1, 2))
    x, y = np.meshgrid(np.arange(columns * per_pixel) / per_pixel, np.arange(rows * per_pixel) / per_pixel)
    return np.stack([x.ravel(), y.ravel()], axis=1)


def nearest(setup: Setup, of: FloatArray, among: FloatArray) -> IndexArray:
    """For each place of `of` the index of the nearest one of `among`, on the torus of the tile."""
    rows, columns = setup.mosaic.indices.shape
    size = np.array([columns, rows])
    apart = np.abs(of[:, None] - among[None]) % size
    apart = np.minimum(apart, size - apart)
    return np.asarray((apart**2).sum(axis=2).argmin(axis=1))
