"""Optical crosstalk: part of a pixel's light comes through the filters of its four neighbors."""

from __future__ import annotations

import numpy as np

from ..base.types import FloatArray
from .mosaic import Mosaic
from .view import View


def mixed(light: FloatArray, share: float, *, periodic: bool = False) -> FloatArray:
    """(1 - share) of a pixel's own and share / 4 of each neighbor's: ndarray[n_cases, rows, columns, ...], same shape.

    Beyond the border is nothing, or, for the tile of a uniform field, the other side.
    """
    found = (1 - share) * light
    given = share / 4 * light
    for axis in (1, 2):
        if periodic:
            found += np.roll(given, 1, axis=axis)
            found += np.roll(given, -1, axis=axis)
            continue
        to, of = np.moveaxis(found, axis, 0), np.moveaxis(given, axis, 0)
        to[1:] += of[:-1]
        to[:-1] += of[1:]
    return np.asarray(found, dtype=float)


def taken(mosaic: Mosaic, share: float) -> FloatArray:
    """What pixels of a tile take of the light through each channel's filter, ndarray[n_rows, n_columns, n_channels]."""
    whole = (mosaic.indices[..., None] == np.arange(len(mosaic.channels))).astype(float)
    return np.asarray(mixed(whole[None], share, periodic=True)[0])


def share(view: View) -> float:
    """Share of a pixel's light that comes through the filters of its neighbors."""
    return view.pixel.crosstalk if view.computes("crosstalk") else 0.0
