"""The light of the pixels deep inside a large light, of which many places are looked at: sums, known from a few places.

Wherever the light is between the center of a pixel and its corner, these pixels are whole in the readout. As a function
of the place, the sum of their light has no finer detail than the image: it is a polynomial, the one through its values
at the nodes of Chebyshev.
"""

from __future__ import annotations

import math

import numpy as np

from ..base.types import BoolArray, FloatArray
from . import chebyshev
from .compiled_pixels import Rings, kernels_by_ring
from .effects import crosstalk, sampling
from .mosaic import Mosaic

_FURTHEST_PX = 0.5
"""Places are so far from the center of a pixel at most, along a row and a column."""
_FEWEST = 100
"""Pixels, of less of which it does not pay."""
_RESIDUAL = 1e-10
"""No polynomial that is left out is larger, relative to a uniform field."""


def inner_pixels(half: float, readout_px: float) -> BoolArray:
    """Which pixels around one are whole, with their neighbors, wherever the light is at it: ndarray[n, n], n odd.

    `half`: of a pixel's side; `readout_px`: the radius of the readout.
    """
    reach = math.ceil(readout_px) + 1
    apart = np.arange(-reach, reach + 1)
    furthest = np.maximum(np.abs(apart), np.abs(apart - _FURTHEST_PX)) + half
    whole = furthest[:, None] ** 2 + furthest**2 <= readout_px**2
    beside = whole[2:, 1:-1] & whole[:-2, 1:-1] & whole[1:-1, 2:] & whole[1:-1, :-2]
    return np.asarray(whole[1:-1, 1:-1] & beside)


def _nodes(order: int) -> FloatArray:
    """Those of Chebyshev along a row or column, pixels."""
    return np.asarray(_FURTHEST_PX / 2 * (1 + chebyshev.roots(order)))


def _is_square(mosaic: Mosaic) -> bool:
    rows, columns = mosaic.indices.shape
    return bool(rows == columns)


class InnerLight:
    """What inner pixels add to kernels at places between the center of a pixel and its corner.

    `nearest_px`: no other pixel is nearer to a light.
    """

    def __init__(self, rings: Rings, finest_per_px: float, half: float, readout_px: float, mosaic: Mosaic) -> None:
        """`finest_per_px`: the highest frequency of the image; `mosaic`: each pixel of its tile is a channel."""
        self._inside = inner_pixels(half, readout_px)
        apart = np.arange(len(self._inside)) - len(self._inside) // 2
        outer = np.hypot(*np.meshgrid(apart, apart))[~self._inside]
        self.nearest_px = max(float(outer.min()) - 2**0.5 * _FURTHEST_PX, 0.0)
        finest = 2 * math.pi * finest_per_px * _FURTHEST_PX / 2
        most = math.ceil(finest + 4 * finest ** (1 / 3) + 6)  # J_n(x) falls fast from n = x on
        order = self._needed(most, rings, mosaic)
        light = self._at_nodes(order, rings, mosaic)
        to_orders = chebyshev.to_orders(order)
        self._sums = np.kron(to_orders, to_orders) @ light.reshape(order**2, -1)
        self._order, self._shape = order, light.shape[1:]

    def _needed(self, most: int, rings: Rings, mosaic: Mosaic) -> int:
        """The order of the polynomial: the images have little of their finest detail, and less of it inside."""
        middle, nodes = np.full(most, _FURTHEST_PX / 2), _nodes(most)
        needed, residual = 0, _RESIDUAL * self._inside.sum() / len(mosaic.channels)
        for along in ((nodes, middle), (middle, nodes))[: 1 if _is_square(mosaic) else 2]:
            light = self._summed(np.stack(along, axis=1), rings, mosaic)
            sizes = np.abs(chebyshev.to_orders(most) @ light.reshape(most, -1)).max(axis=1)
            needed = max(needed, 1 + int(np.flatnonzero(sizes > residual)[-1]))
        return min(needed + 1, most)

    def _at_nodes(self, order: int, rings: Rings, mosaic: Mosaic) -> FloatArray:
        """`_summed` at the nodes along both axes, row by row.

        Those on one side of the diagonal of a square tile see what those on the other side see, turned over it.
        """
        nodes, (row, column) = _nodes(order), np.indices((order, order)).reshape(2, -1)
        own = column >= row if _is_square(mosaic) else np.ones(row.size, dtype=bool)
        light = self._summed(np.stack([nodes[column[own]], nodes[row[own]]], axis=1), rings, mosaic)
        found = np.empty((order, order, *light.shape[1:]))
        if _is_square(mosaic):
            found[column[own], row[own]] = light[:, mosaic.indices.T.ravel()]
        found[row[own], column[own]] = light
        return found.reshape(order**2, *light.shape[1:])

    @staticmethod
    def pays(half: float, readout_px: float) -> bool:
        """Whether a light is large enough."""
        return int(inner_pixels(half, readout_px).sum()) >= _FEWEST

    def _summed(self, places_px: FloatArray, rings: Rings, mosaic: Mosaic) -> FloatArray:
        """The light of the inner pixels of each channel, one by one: ndarray[n_places, n_channels, n_functions]."""
        seen, n = sampling.window(mosaic, places_px, len(self._inside) // 2), len(mosaic.channels)
        inside = self.among(seen, places_px)
        weights = np.repeat(inside[None].astype(float), len(places_px), axis=0)
        pairs, by_ring = np.where(np.eye(n) > 0, np.arange(n), -1), np.zeros((len(places_px), n, len(rings.shares)))
        own = seen.columns, seen.rows, weights, seen.channel, np.zeros_like(inside)
        kernels_by_ring(*own, 0.0, rings, 0, pairs, by_ring, np.empty((len(places_px), n)))
        return np.asarray((by_ring.reshape(-1, len(rings.shares)) @ rings.shares).reshape(*by_ring.shape[:2], -1))

    def among(self, seen: sampling.Window, places_px: FloatArray) -> BoolArray:
        """Which pixels of a window are inner ones, ndarray[n_rows, n_columns]."""
        reach = len(self._inside) // 2
        found = np.ones(seen.channel.shape, dtype=bool)
        at = []
        for axis, apart in enumerate((seen.rows[0], seen.columns[0])):
            pixel = np.rint(apart + places_px[0, 1 - axis]).astype(int)
            found &= (np.abs(pixel) <= reach)[:, None] if axis == 0 else np.abs(pixel) <= reach
            at.append(np.clip(pixel + reach, 0, 2 * reach))
        return np.asarray(found & self._inside[np.ix_(*at)])

    def at(self, places_px: FloatArray) -> FloatArray:
        """The light of the inner pixels of each channel, ndarray[n_places, n_channels, n_functions]."""
        angles = np.arccos(np.clip(places_px * (2 / _FURTHEST_PX) - 1, -1, 1))
        x, y = (chebyshev.polynomials(axis, self._order) for axis in angles.T)
        shares = (y[:, :, None] * x[:, None]).reshape(len(places_px), -1)
        return np.asarray((shares @ self._sums).reshape(len(places_px), *self._shape))


def taken_by_channels(mosaic: Mosaic, share: float) -> FloatArray:
    """What each channel takes of the light of a pixel of each, ndarray[n_channels, n_channels].

    `mosaic`: each pixel of its tile is a channel; `share`: of light that comes through the neighbors' filters.
    """
    n = len(mosaic.channels)
    found = np.zeros((n, n))
    found[:, mosaic.indices.ravel()] = crosstalk.taken(mosaic, share).reshape(-1, n).T
    return found
