"""Integration over wavelengths: on every node of the grid, or with QE curves that are linear between fewer nodes."""

from __future__ import annotations

import numpy as np

from ...types import FloatArray, IndexArray
from ..view import Setup

METHODS = ("every 10th", "every 5th", "every 2nd", "grid")
_STEP = {"every 10th": 10, "every 5th": 5, "every 2nd": 2, "grid": 1}


def nodes(n_wavelengths: int, method: str) -> IndexArray:
    """Indices of the wavelengths at which QE is looked at; the last one is always among them."""
    kept = np.arange(0, n_wavelengths, _STEP[method])
    return kept if kept[-1] == n_wavelengths - 1 else np.append(kept, n_wavelengths - 1)


def hats(n_wavelengths: int, kept: IndexArray) -> FloatArray:
    """Weights of the nodes at every wavelength, ndarray[n_nodes, n_wavelengths]: QE is about QE[nodes] @ hats."""
    at = np.arange(n_wavelengths)
    return np.stack([np.interp(at, kept, unit) for unit in np.eye(kept.size)])


def deviation(low: FloatArray, high: FloatArray, kept: IndexArray) -> tuple[FloatArray, FloatArray]:
    """QE between `low` and `high` minus its interpolation: middle and half width, ndarray[..., n_wavelengths] each."""
    between = hats(low.shape[-1], kept)
    below, above = low - high[..., kept] @ between, high - low[..., kept] @ between
    below[..., kept] = above[..., kept] = 0.0
    return (below + above) / 2, (above - below) / 2


def skip_is_exact(setup: Setup) -> str | None:
    """Fewer nodes never are exact for all curves, unless the grid has hardly any."""
    return "a grid of two nodes" if setup.grid.size <= 2 else None
