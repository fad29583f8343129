"""Integration over wavelengths: on every node of the grid, or with QE curves that are linear between fewer nodes."""

from __future__ import annotations

import numpy as np

from ...base.types import FloatArray, IndexArray
from ...curves.hats import hats
from ..shot import Shot
from .base import Change, Chosen, CurveChange, Designs, LinearEffect, Load, Stage

_STEP = {"every 10th": 10, "every 5th": 5, "every 2nd": 2, "grid": 1}


def nodes(n_wavelengths: int, method: str) -> IndexArray:
    """Indices of the wavelengths at which QE is looked at; the last one is always among them."""
    kept = np.arange(0, n_wavelengths, _STEP[method])
    return kept if kept[-1] == n_wavelengths - 1 else np.append(kept, n_wavelengths - 1)


def between_nodes(n_wavelengths: int, kept: IndexArray) -> FloatArray:
    """QE is about QE[nodes] times this, ndarray[n_nodes, n_wavelengths]."""
    return hats(np.arange(n_wavelengths, dtype=float), kept.astype(float))


def deviation(low: FloatArray, high: FloatArray, kept: IndexArray) -> tuple[FloatArray, FloatArray]:
    """QE between `low` and `high` minus its interpolation: middle and half width, ndarray[..., n_wavelengths] each."""
    between = between_nodes(low.shape[-1], kept)
    below, above = low - high[..., kept] @ between, high - low[..., kept] @ between
    below[..., kept] = above[..., kept] = 0.0
    return (below + above) / 2, (above - below) / 2


class Quadrature(LinearEffect):
    """At which wavelengths QE curves are looked at."""

    name = "quadrature"
    methods = tuple(_STEP)
    stage = Stage.SAMPLING
    order = 0
    off = None

    def exact(self, shot: Shot) -> str | None:
        """Fewer nodes never are exact for all curves, unless the grid has hardly any."""
        return "a grid of two nodes" if shot.grid.size <= 2 else None

    def change(self, shot: Shot, before: str, after: str, designs: Designs, *, straight: bool) -> Change:
        """What the curves are between their nodes."""
        kept = nodes(shot.grid.size, after)
        middle, half = deviation(designs.qe_low, designs.qe_high, kept)
        return CurveChange(middle - half, middle + half)

    def work(self, shot: Shot, methods: Chosen, load: Load) -> Load:
        """A product at every node."""
        return load._replace(nodes=nodes(shot.grid.size, methods.quadrature).size)
