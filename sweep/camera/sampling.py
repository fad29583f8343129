"""Mosaic sampling: pixels that a light covers, optical crosstalk, and weights of the pixels in the readout.

Crosstalk: part of a pixel's light comes through the filters of its four neighbors. A readout is the mean over the
disc, or the demosaicked value at one pixel, for any tile.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..base.types import Array, Float, IndexArray, Int, Num
from .mosaic import Mosaic
from .scene import Target
from .setup import Setup


@dataclass(frozen=True)
class Window:
    """Pixels around a light for some phases, with a margin of one pixel that has no weight.

    `channel`: channel of each pixel; `dx`, `dy`: distance from the light's center along columns and rows, pixels.
    """

    channel: Int[IndexArray, "rows columns"]
    dx: Num[Array, "cases rows columns"]
    dy: Num[Array, "cases rows columns"]

    @property
    def columns(self) -> Float[Array, "rows columns"]:
        """`dx` of each column."""
        return np.ascontiguousarray(self.dx[:, 0, :])

    @property
    def rows(self) -> Float[Array, "rows columns"]:
        """`dy` of each row."""
        return np.ascontiguousarray(self.dy[:, :, 0])


@lru_cache(maxsize=64)
def radii_px(setup: Setup, target: Target) -> tuple[float, float]:
    """Return the radii of light and readout; the readout reaches a pixel of every channel."""
    radius = target.object_resolution_px / 2
    rows, columns = setup.camera.mosaic.indices.shape
    return radius, max(radius, math.hypot(rows, columns) / 2)


@lru_cache(maxsize=64)
def reach_px(setup: Setup, target: Target) -> float:
    """Return the largest distance along a row or column of a pixel with a weight."""
    if target.readout == "mean":
        return radii_px(setup, target)[1] + 0.5
    return float(max(setup.camera.mosaic.indices.shape))


def window(mosaic: Mosaic, phases_px: Float[Array, "cases 2"], reach_px: float) -> Window:
    """Return all pixels near the centers of the light.

    `phases_px`: centers as (column, row), pixels.
    """
    low = np.floor(phases_px.min(axis=0) - reach_px).astype(int) - 1
    high = np.ceil(phases_px.max(axis=0) + reach_px).astype(int) + 1
    columns, rows = (np.arange(a, b + 1) for a, b in zip(low, high, strict=True))
    tile = mosaic.indices
    channel = tile[np.ix_(rows % tile.shape[0], columns % tile.shape[1])]
    shape = len(phases_px), rows.size, columns.size
    dx = np.broadcast_to((columns - phases_px[:, :1])[:, None], shape)
    dy = np.broadcast_to((rows - phases_px[:, 1:])[:, :, None], shape)
    return Window(channel, dx, dy)


def mean_weights(window: Window, half: float, readout_px: float, n_channels: int) -> Float[Array, "cases rows columns"]:
    """Return the weight of each pixel in the mean of its channel.

    `half`: half of the side of a pixel's light-sensitive square, pixels. The weights of each channel sum to 1.
    """
    from .disc_kernels import covered_by_disc  # noqa: PLC0415  (compiled: kept off the start-up path)

    weights = covered_by_disc(window.columns, window.rows, half, readout_px)
    for channel in range(n_channels):
        in_channel = window.channel == channel
        weights[:, in_channel] /= weights[:, in_channel].sum(axis=1, keepdims=True)
    return weights


def center_weights(window: Window, home: Float[Array, "cases 2"], mosaic: Mosaic) -> Float[Array, "cases rows columns"]:
    """Return the weight of each pixel in the demosaicked value of its channel at one pixel.

    Normalized convolution with a tent as wide as the tile, (1 - |dx| / columns)(1 - |dy| / rows), which for a Bayer
    tile is bilinear interpolation.

    `home`: pixel that is read out, as (column, row) from the light's center, pixels. The weights of each channel sum to
    1.
    """
    # From pixel to pixel: whole numbers, so that equal weights are equal to the last bit.
    dx, dy = (np.rint(a - home[:, axis, None, None]) for axis, a in enumerate((window.dx, window.dy)))
    rows, columns = mosaic.indices.shape
    weights = np.maximum(0.0, 1 - np.abs(dx) / columns) * np.maximum(0.0, 1 - np.abs(dy) / rows)
    for channel in range(len(mosaic.channels)):
        in_channel = window.channel == channel
        values = weights[:, in_channel]
        weights[:, in_channel] = values / values.sum(axis=1, keepdims=True)
    return np.asarray(weights, dtype=float)


def crosstalk_parts(share: float) -> tuple[tuple[float, int, int], ...]:
    """Return the parts of a pixel's light, and how many rows and columns from it each passes a filter."""
    if not share:
        return ((1.0, 0, 0),)
    return ((1 - share, 0, 0), *((share / 4, down, right) for down, right in ((-1, 0), (1, 0), (0, -1), (0, 1))))


def with_crosstalk(
    light: Float[Array, "cases rows columns *batch"], share: float
) -> Float[Array, "cases rows columns *batch"]:
    """Mix each pixel with its neighbors (see `crosstalk_parts`); nothing lies beyond the border."""
    rows, columns = light.shape[1:3]
    around = np.pad(light, ((0, 0), (1, 1), (1, 1), *((0, 0),) * (light.ndim - 3)))
    mixed = np.zeros(light.shape)
    for part, down, right in crosstalk_parts(share):
        mixed += part * around[:, 1 + down : 1 + down + rows, 1 + right : 1 + right + columns]
    return mixed


def crosstalk_share(setup: Setup) -> float:
    """Return the share of a pixel's light that comes through the filters of its neighbors.

    0 if crosstalk is left out.
    """
    return setup.camera.pixel.crosstalk if setup.computes("crosstalk") else 0.0
