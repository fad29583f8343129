"""Classes of pixels that a place of the light tells apart, and which places see the same but for their classes.

The light of a pixel depends on where the light falls from it, not on its color. So the pixels of a small tile are told
apart one by one, whatever the CFA: a light that is moved by a pixel, mirrored or turned over the diagonal sees the same
pixels in another order.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..base.types import FloatArray, IndexArray
from .mosaic import Mosaic
from .view import View

_MOST_PIXELS = 4
"""Of a tile whose pixels are told apart one by one."""


class Classes(NamedTuple):
    """`channel`: of each class, ndarray[n_classes]; `tile`: (rows, columns) of a tile whose pixels are the classes one
    after the other, None where a class is a channel.
    """

    channel: IndexArray
    tile: tuple[int, int] | None

    def images(self, places_px: FloatArray) -> tuple[FloatArray, IndexArray]:
        """The places that stand for some, ndarray[n, 2] both, and the class there of each class, ndarray[n, n_classes].

        They lie between the center of a pixel and its corner, and on one side of the diagonal where the tile is square.
        """
        if self.tile is None:
            return places_px, np.tile(np.arange(self.channel.size), (len(places_px), 1))
        rows, columns = self.tile
        nearest = np.floor(places_px + 0.5)
        apart = places_px - nearest
        sign = np.where(apart < 0, -1, 1)
        image = np.abs(apart)
        pixels = np.stack(np.divmod(np.arange(rows * columns), columns)[::-1], axis=1)  # (column, row)
        seen = sign[:, None] * (pixels - nearest.astype(int)[:, None])
        if rows == columns:
            turned = image[:, 1] > image[:, 0]
            image[turned], seen[turned] = image[turned, ::-1], seen[turned, :, ::-1]
        return image, np.mod(seen[..., 1], rows) * columns + np.mod(seen[..., 0], columns)


def classes_of(view: View) -> tuple[View, Classes]:
    """A view of a mosaic in which every class is a channel of its own, and the classes.

    A demosaicked pixel is made of its channel's pixels, and a large tile has too many.
    """
    target, tile = view.scenario.target, view.mosaic.indices
    assert target is not None
    if target.readout == "center" or tile.size > _MOST_PIXELS:
        return view, Classes(np.arange(len(view.mosaic.channels)), None)
    names = tuple(str(at) for at in range(tile.size))
    numbers = np.arange(tile.size).reshape(tile.shape)
    apart = Mosaic("", names, tuple(tuple(int(v) for v in row) for row in numbers))
    nothing = np.zeros((tile.size, view.grid.size))
    return replace(view, mosaic=apart, qe=nothing), Classes(tile.ravel(), tile.shape)
