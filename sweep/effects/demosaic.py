"""Demosaicking at one pixel, for any tile: the mean of a channel's pixels near it."""

from __future__ import annotations

import numpy as np

from ..arrays import FloatArray
from ..setup import Setup
from .sampling import Window

METHODS = ("skip", "tent")


def skip_is_exact(setup: Setup) -> str | None:
    """Why leaving demosaicking out changes nothing; None when it does."""
    target = setup.scenario.target
    if target is None:
        return "a patch that fills the field"
    return "the raw pixels are averaged" if target.readout == "mean" else None


def center_weights(seen: Window, method: str, tile_shape: tuple[int, int], n_channels: int) -> FloatArray:
    """Weight of each pixel in the value of its channel at the pixel nearest to the light's center.

    ndarray[n_cases, rows, columns]; each channel's sum to 1. `tent`: normalized convolution with a tent as wide as the
    tile, (1 - |dx| / columns)(1 - |dy| / rows), which for a Bayer tile is bilinear interpolation. `skip`: the nearest
    pixel of each channel, the mean where several are equally near.
    """
    dx, dy = seen.dx - _nearest_offset(seen.dx), seen.dy - _nearest_offset(seen.dy)
    rows, columns = tile_shape
    weights = np.maximum(0.0, 1 - np.abs(dx) / columns) * np.maximum(0.0, 1 - np.abs(dy) / rows)
    if method == "skip":
        weights = -(dx**2 + dy**2)
    for channel in range(n_channels):
        own = seen.channel == channel
        values = weights[:, own]
        if method == "skip":
            values = (values >= values.max(axis=1, keepdims=True) - 1e-9).astype(float)
        weights[:, own] = values / values.sum(axis=1, keepdims=True)
    return np.asarray(weights, dtype=float)


def _nearest_offset(offsets: FloatArray) -> FloatArray:
    """Offset of the nearest pixel along one axis, ndarray[n_cases, 1, 1]."""
    flat = offsets.reshape(len(offsets), -1)
    nearest = np.abs(flat).argmin(axis=1)
    return np.asarray(flat[np.arange(len(flat)), nearest][:, None, None], dtype=float)
