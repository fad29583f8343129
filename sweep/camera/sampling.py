"""Mosaic sampling: which pixels a light covers, optical crosstalk between them, and their weights in the readout.

Crosstalk: part of a pixel's light comes through the filters of its four neighbors. A readout is the mean over the disc,
or demosaicking at one pixel, for any tile.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..base.types import FloatArray, IndexArray
from .mosaic import Mosaic
from .scene import Target
from .setup import Setup


@dataclass(frozen=True)
class Window:
    """Pixels around a light for some places of its center.

    `channel`: ndarray[rows, columns] of channel indices; `dx`, `dy`: ndarray[n_cases, rows, columns], pixels from the
    light's center. One pixel of margin on every side has no weight in any readout.
    """

    channel: IndexArray
    dx: FloatArray
    dy: FloatArray

    @property
    def columns(self) -> FloatArray:
        """`dx` of each column, ndarray[n_cases, columns]."""
        return np.ascontiguousarray(self.dx[:, 0, :])

    @property
    def rows(self) -> FloatArray:
        """`dy` of each row, ndarray[n_cases, rows]."""
        return np.ascontiguousarray(self.dy[:, :, 0])


def radii_px(setup: Setup, target: Target) -> tuple[float, float]:
    """Radius of the light and of the readout, in pixels; a readout reaches a pixel of every channel."""
    radius = target.object_resolution_px / 2
    rows, columns = setup.camera.mosaic.indices.shape
    return radius, max(radius, math.hypot(rows, columns) / 2)


def reach_px(setup: Setup, target: Target) -> float:
    """Largest distance from the light's center of a pixel with a weight, along a row or column."""
    if target.readout == "mean":
        return radii_px(setup, target)[1] + 0.5
    return float(max(setup.camera.mosaic.indices.shape))


def window(mosaic: Mosaic, phases_px: FloatArray, reach_px: float) -> Window:
    """All pixels within `reach_px` (and the margin) of the light's centers, ndarray[n_cases, 2] as (column, row)."""
    low = np.floor(phases_px.min(axis=0) - reach_px).astype(int) - 1
    high = np.ceil(phases_px.max(axis=0) + reach_px).astype(int) + 1
    columns, rows = (np.arange(a, b + 1) for a, b in zip(low, high, strict=True))
    tile = mosaic.indices
    channel = tile[np.ix_(rows % tile.shape[0], columns % tile.shape[1])]
    shape = len(phases_px), rows.size, columns.size
    dx = np.broadcast_to((columns - phases_px[:, :1])[:, None], shape)
    dy = np.broadcast_to((rows - phases_px[:, 1:])[:, :, None], shape)
    return Window(channel, dx, dy)


def mean_weights(seen: Window, half: float, readout_px: float, n_channels: int) -> FloatArray:
    """Weight of each pixel in the mean of its channel, ndarray[n_cases, rows, columns]; each channel's sum to 1."""
    from .compiled import covered_by_disc  # noqa: PLC0415  (compiled: kept off the start-up path)

    weights = covered_by_disc(seen.columns, seen.rows, half, readout_px)
    for channel in range(n_channels):
        own = seen.channel == channel
        weights[:, own] /= weights[:, own].sum(axis=1, keepdims=True)
    return weights


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


def with_crosstalk(light: FloatArray, share: float, *, periodic: bool = False) -> FloatArray:
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


def crosstalk_share(setup: Setup) -> float:
    """Share of a pixel's light that comes through the filters of its neighbors."""
    return setup.camera.pixel.crosstalk if setup.computes("crosstalk") else 0.0
