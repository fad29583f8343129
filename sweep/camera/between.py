"""What may lie between the places that are looked at: bounds for cells of places.

Over a cell of half width h, a function whose slope along one axis changes by at most omega + L |x - x'| differs from
the line between its two ends by at most omega h / 2 + L h^2 / 2. So the kernel differs from the bilinear interpolation
of its values at a cell's four corners by at most the sum of that over both axes. The kernel is a ratio, of the light
weighed by how much of each pixel the readout covers to the sum of these weights. The slope of a covered area is a
difference of two chords (known up to an interval in every cell), that of a pixel's light a difference of two line
means of the image.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..base.types import FloatArray, IndexArray
from . import kernel
from .compiled_areas import CellWeights, areas
from .compiled_cells import SEGMENTS, SHARP, Envelopes, Light, deviations, ranges
from .compiled_classes import CellBounds, deviations_of_channels
from .effects import blur, crosstalk, demosaic, sampling
from .kernel_size import pixels_per_place
from .methods import Methods
from .view import View

_BETWEEN_NODES = (math.pi / 12) ** 2 / 8
"""A function of one highest frequency, at 24 nodes per period of it, exceeds its nodes by at most this much of its
largest value (Bernstein: its second derivative is at most the square of that frequency times this value)."""
_BANDS = 12
"""Bands of wavelengths in which the light is bounded apart."""
_AT_ONCE = 4_000_000
"""Values of pixels that are held at once."""


def _envelopes(profile: blur.Profile, pitch_um: float, parts: list[tuple[FloatArray, FloatArray]]) -> Envelopes:
    """Of parts of a blurred image; a part is one wavelength or several.

    `parts`: values and slopes at the profile's radii, ndarray[n_radii, n_wavelengths] each.
    """
    step = float(profile.r_um[1]) / pitch_um
    steep = np.stack([np.abs(slopes).max(axis=1) for _, slopes in parts], axis=1)
    steep = (steep + _BETWEEN_NODES * steep.max(axis=0)) * pitch_um
    margin = step * steep.max(axis=0)  # what a part changes between two nodes
    above, below = (np.stack([f(values, axis=1) for values, _ in parts], axis=1) for f in (np.max, np.min))
    above = np.maximum.accumulate(above[::-1], axis=0)[::-1] + margin
    return Envelopes(above, np.minimum.accumulate(below, axis=0) - margin, steep, 1 / step)


class Deviation(NamedTuple):
    """How far the kernel in cells of places may be from what it is at their corners.

    `kernel`: ndarray[n_cells, n_channels, n_channels, n_bands], from a mean of its values at the corners, of which each
    channel has one. `tilt`: ndarray[n_cells, n_channels], how much the weights of that mean may differ, relative to
    them, from those of the bilinear interpolation, which are the same for all channels.
    """

    kernel: FloatArray
    tilt: FloatArray


class Between:
    """Bounds between places, for one way to compute the kernel of a scene."""

    def __init__(self, view: View, methods: Methods, knots_nm: FloatArray) -> None:
        """The kernel is linear between the wavelengths `knots_nm`; a band is some of their intervals."""
        target, n = view.scenario.target, len(view.mosaic.channels)
        assert target is not None
        self._view, self._methods, self._target = view, methods, target
        self._half = view.pixel.fill_factor**0.5 / 2
        self._radii = sampling.radii_px(view, target)
        self._reach = sampling.reach_px(view, target) + 0.5
        self._share = crosstalk.share(view, methods.crosstalk)
        profile = kernel.profile_of(view, methods, knots_nm)
        self._knots_nm, self._pitch_um = knots_nm, view.pixel.pitch_um
        n_bands = min(_BANDS, knots_nm.size - 1) if profile is not None else 0
        self._ends = np.linspace(0, knots_nm.size - 1, n_bands + 1).astype(int) if n_bands else np.zeros(1, dtype=int)
        total = view.lights.photons.sum(axis=0)
        self._middle = int(np.abs(knots_nm - view.grid.nodes_nm @ total / total.sum()).argmin())
        self._is_sharp = profile is None
        self._images = SHARP if profile is None else self._images_of(profile)
        self._nearby: dict[float, Envelopes] = {}
        # What each pixel of a channel takes of the light through each channel's filter: mean, and by how much of it
        # pixels differ.
        whole = (view.mosaic.indices[..., None] == np.arange(n)).astype(float)
        taken = crosstalk.mixed(whole[None], self._share, periodic=True)[0]
        own = [taken[whole[..., to] > 0] for to in range(n)]
        self._taken = np.stack([pixels.mean(axis=0) for pixels in own])
        apart = np.stack([np.abs(pixels - pixels.mean(axis=0)).max(axis=0) for pixels in own])
        self.uneven = np.divide(apart, self._taken, out=np.zeros_like(apart), where=self._taken > 0)

    def _images_of(self, profile: blur.Profile) -> Envelopes:
        """That at the middle wavelength, and what differs from it in each band."""
        values, slopes = profile.values, profile.slopes
        middle = slice(self._middle, self._middle + 1)
        parts = [(values[:, middle], slopes[:, middle])]
        for a, b in pairwise(self._ends):
            some = slice(a, b + 1)
            parts.append((values[:, some] - values[:, middle], slopes[:, some] - slopes[:, middle]))
        return _envelopes(profile, self._pitch_um, parts)

    def _near(self, h: float) -> Envelopes:
        """The envelopes for cells of half width `h`: slopes are those of all radii that a piece of an edge may have."""
        if self._is_sharp:
            return SHARP
        if h not in self._nearby:
            from scipy.ndimage import maximum_filter1d  # noqa: PLC0415  (slow to import)

            piece = 2 * self._half / SEGMENTS
            width = 3 + 2 * math.ceil(math.hypot(h, h + piece / 2) * self._images.per_px)
            steep = maximum_filter1d(self._images.steep, width, axis=0, mode="nearest")
            self._nearby[h] = self._images._replace(steep=np.ascontiguousarray(steep))
        return self._nearby[h]

    @property
    def n_parts(self) -> int:
        """Parts of the light that are bounded apart: all of it as at the middle wavelength, and the rest by band."""
        return len(self._ends)

    def amounts(self, light: FloatArray) -> FloatArray:
        """Size of each part of a light, ndarray[..., n_wavelengths] (of the scene's grid) -> ndarray[..., n_parts]."""
        whole = np.abs(light.sum(axis=-1, keepdims=True))
        if self.n_parts == 1:
            return np.asarray(whole, dtype=float)
        band = np.searchsorted(self._knots_nm[self._ends[1:-1]], self._view.grid.nodes_nm)
        held, starts = np.unique(band, return_index=True)
        found = np.zeros((*light.shape[:-1], self.n_parts))
        found[..., :1], found[..., 1 + held] = whole, np.add.reduceat(np.abs(light), starts, axis=-1)
        return found

    def ranges(self, kernels: FloatArray) -> FloatArray:
        """Range of each part of kernels, ndarray[n, n_channels, n_channels, n_knots or 1] -> ndarray[2, n,
        n_channels, n_channels, n_parts].
        """
        flat = np.ascontiguousarray(kernels.reshape(-1, kernels.shape[-1]))
        middle = min(self._middle, flat.shape[1] - 1)
        return ranges(flat, middle, self._ends).reshape(2, *kernels.shape[:-1], self.n_parts)

    def of_cells(self, centers: FloatArray, h: float, homes: FloatArray, corners: FloatArray) -> Deviation:
        """Of cells of half width `h` around `centers` (ndarray[n, 2]), read out at `homes` (ndarray[n, 2]).

        `corners`: `ranges` of the kernel at their corners, ndarray[2, n, 4, n_channels, n_channels, n_parts].
        """
        bounds = self.bounds(centers, h, homes, corners[0].min(axis=1), corners[1].max(axis=1))
        every = np.arange(bounds.jumps.shape[1])
        which = np.tile(every, (len(centers), 1))
        return of_channels(bounds, self.uneven, np.arange(len(centers)), which, every)

    def bounds(self, centers: FloatArray, h: float, homes: FloatArray, low: FloatArray, high: FloatArray) -> CellBounds:
        """What channels have in cells, before it is related to the sums of their weights.

        `low`, `high`: range of the kernel over the corners, ndarray[n, n_channels, n_channels, n_parts].
        """
        step = max(1, _AT_ONCE // (pixels_per_place(self._view) * self.n_parts))
        parts = []
        for at in range(0, len(centers), step):
            some = slice(at, at + step)
            parts.append(self._of_block(centers[some], h, homes[some], low[some], high[some]))
        return CellBounds(*(np.concatenate(each) for each in zip(*parts, strict=True)))

    def _of_block(
        self, centers: FloatArray, h: float, homes: FloatArray, low: FloatArray, high: FloatArray
    ) -> CellBounds:
        """See the head of this file. A ratio k = M / D is that of the interpolations, r, but for dev(M - r D) / D; r is
        a mean of the corners' values, and dev(M - r D) is the sum of dev(weight x (light - r)) over the pixels.
        """
        mosaic = self._view.mosaic
        n = len(mosaic.channels)
        seen = sampling.window(mosaic, centers, self._reach)
        x, y = seen.columns, seen.rows
        if self._target.readout == "center":  # the weights of a demosaicked pixel are the same in the whole cell
            weighed = demosaic.center_weights(seen, homes - centers, self._methods.demosaic, mosaic)
            nothing = np.zeros_like(weighed)
            weights = CellWeights(weighed, nothing, nothing, nothing)
            sums, jumps = np.ones((len(x), 4, n)), np.zeros((len(x), n))
        else:
            weights, sums, jumps = areas(x, y, seen.channel, n, self._half, self._radii[1], h)
        found = np.empty((len(x), n, n, self.n_parts))
        light = Light(self._near(h), self._half, self._radii[0], self._share, self._taken)
        deviations(x, y, seen.channel, weights, light, h, np.stack([low, high], axis=1), found)
        return CellBounds(found, sums, jumps, low, high)


def of_channels(
    bounds: CellBounds, uneven: FloatArray, rows: IndexArray, which: IndexArray, channel: IndexArray
) -> Deviation:
    """Of the channels that classes of pixels are in: see `compiled_classes.deviations_of_channels`."""
    n = int(channel.max()) + 1
    kernels = np.empty((len(rows), n, n, bounds.sizes.shape[3]))
    tilt = np.empty((len(rows), n))
    deviations_of_channels(bounds, uneven, rows, which, channel, kernels, tilt)
    return Deviation(kernels, tilt)
