"""Demosaicking at one pixel, for any tile: the mean of a channel's pixels near it."""

from __future__ import annotations

import numpy as np

from ..base.types import FloatArray
from .mosaic import Mosaic
from .sampling import Window


def center_weights(seen: Window, home: FloatArray, mosaic: Mosaic) -> FloatArray:
    """Weight of each pixel in the value of its channel at the pixel that is read out.

    `home`: ndarray[n_cases, 2], that pixel from the light's center (column, row), pixels. Returns ndarray[n_cases,
    rows, columns]; each channel's sum to 1. Normalized convolution with a tent as wide as the tile,
    (1 - |dx| / columns)(1 - |dy| / rows), which for a Bayer tile is bilinear interpolation.
    """
    # From pixel to pixel: whole numbers, so that equal weights are equal to the last bit.
    dx, dy = (np.rint(a - home[:, axis, None, None]) for axis, a in enumerate((seen.dx, seen.dy)))
    rows, columns = mosaic.indices.shape
    weights = np.maximum(0.0, 1 - np.abs(dx) / columns) * np.maximum(0.0, 1 - np.abs(dy) / rows)
    for channel in range(len(mosaic.channels)):
        own = seen.channel == channel
        values = weights[:, own]
        weights[:, own] = values / values.sum(axis=1, keepdims=True)
    return np.asarray(weights, dtype=float)
