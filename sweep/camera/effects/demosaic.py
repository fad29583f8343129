"""Demosaicking at one pixel, for any tile: the mean of a channel's pixels near it."""

from __future__ import annotations

import numpy as np

from ...base.types import FloatArray
from ..mosaic import Mosaic
from ..shot import Shot
from .base import KernelEffect, Part, Stage
from .sampling import Window


def center_weights(seen: Window, home: FloatArray, method: str, mosaic: Mosaic) -> FloatArray:
    """Weight of each pixel in the value of its channel at the pixel that is read out.

    `home`: ndarray[n_cases, 2], that pixel from the light's center (column, row), pixels. Returns ndarray[n_cases,
    rows, columns]; each channel's sum to 1. `tent`: normalized convolution with a tent as wide as the tile,
    (1 - |dx| / columns)(1 - |dy| / rows), which for a Bayer tile is bilinear interpolation. `skip`: the nearest pixel
    of each channel, the mean where several are equally near.
    """
    # From pixel to pixel: whole numbers, so that methods which weigh alike do so to the last bit.
    dx, dy = (np.rint(a - home[:, axis, None, None]) for axis, a in enumerate((seen.dx, seen.dy)))
    rows, columns = mosaic.indices.shape
    weights = np.maximum(0.0, 1 - np.abs(dx) / columns) * np.maximum(0.0, 1 - np.abs(dy) / rows)
    if method == "skip":
        weights = -(dx**2 + dy**2)
    for channel in range(len(mosaic.channels)):
        own = seen.channel == channel
        values = weights[:, own]
        if method == "skip":
            values = (values >= values.max(axis=1, keepdims=True) - 1e-9).astype(float)
        weights[:, own] = values / values.sum(axis=1, keepdims=True)
    return np.asarray(weights, dtype=float)


class Demosaic(KernelEffect):
    """Which pixels the readout at one pixel is made of."""

    name = "demosaic"
    methods = ("skip", "tent")
    stage = Stage.SAMPLING
    order = 3
    part = Part.WEIGHTS

    def exact(self, shot: Shot) -> str | None:
        """Only a readout at the center is demosaicked."""
        target = shot.scenario.target
        if target is None:
            return "a patch that fills the field"
        return "the raw pixels are averaged" if target.readout == "mean" else None
