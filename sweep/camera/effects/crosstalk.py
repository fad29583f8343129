"""Optical crosstalk: part of a pixel's light comes through the filters of its four neighbors."""

from __future__ import annotations

import numpy as np

from ...types import FloatArray
from ..view import Setup

METHODS = ("skip", "neighbors")


def skip_is_exact(setup: Setup) -> str | None:
    """Why leaving crosstalk out changes nothing; None when it does."""
    return "no crosstalk" if setup.pixel.crosstalk == 0 else None


def mixed(light: FloatArray, share: float, *, periodic: bool = False) -> FloatArray:
    """(1 - share) of a pixel's own and share / 4 of each neighbor's: ndarray[n_cases, rows, columns, ...], same shape.

    Beyond the border is nothing, or, for the tile of a uniform field, the other side.
    """
    found = (1 - share) * light
    for axis in (1, 2):
        for step in (1, -1):
            moved = np.roll(light, step, axis=axis)
            if not periodic:
                edge: list[slice | int] = [slice(None)] * light.ndim
                edge[axis] = 0 if step == 1 else -1
                moved[tuple(edge)] = 0.0
            found += share / 4 * moved
    return np.asarray(found, dtype=float)
