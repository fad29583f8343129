"""What may lie between the places that are looked at: bounds for cells of places.

In a cell of half width h the kernel is taken as the biquadratic function through its values at nine nodes: what it may
be off is of the third order of h (`compiled_areas`). The kernel is a ratio, of the light weighed by how much of each
pixel the readout covers to the sum of these weights. The slope of a covered area is a difference of two chords (known
up to an interval in every cell), that of a pixel's light a difference of two line means of the image.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..base.types import FloatArray, IndexArray
from . import kernel
from .compiled_cells import Light, deviations, ranges
from .compiled_classes import CellBounds, deviations_of_channels
from .compiled_distances import amounts_of_pairs
from .compiled_slopes import BENT, BOUNDED, INNER, SEGMENTS, SHARP, STEEP, Envelopes, extremes_of_parts
from .effects import blur, crosstalk, demosaic, sampling
from .methods import Methods
from .view import View

_BETWEEN_NODES = (math.pi / 12) ** 2 / 8
"""A function of one highest frequency, at 24 nodes per period of it, exceeds its nodes by at most this much of its
largest value (Bernstein: its second derivative is at most the square of that frequency times this value)."""
_BANDS = BOUNDED - 1
"""Bands of wavelengths in which the light is bounded apart."""
_AT_ONCE = 256
"""Kernels whose wavelengths are held at once: they stay in the processor's cache."""


def _exceeded(values: FloatArray) -> FloatArray:
    """Sizes at the nodes of the profile, ndarray[n_radii, n_parts], and by how much they are exceeded between them."""
    return np.asarray(values + _more(_BETWEEN_NODES) * values.max(axis=0))


def _more(share: float) -> float:
    """What the largest of some values may lack, relative to it, where that is at most a share of what it should be."""
    return share / (1 - share)


def _envelopes(profile: blur.Profile, pitch_um: float, middle: int, ends: IndexArray) -> Envelopes:
    """Of parts of a blurred image: that at the `middle` wavelength, and what differs from it from one of `ends` to the
    next.

    Of its second derivative, along a radius and across it: central differences of slopes are off by at most step^2 / 6
    times the fourth derivative of the image, and that is at most the square of its highest frequency times its second
    (Bernstein). Across a radius it is slope / radius.
    """
    step, n = float(profile.r_um[1]) / pitch_um, profile.r_um.size
    found = np.empty((4, n, ends.size))
    extremes_of_parts(profile.values, profile.slopes * pitch_um, middle, ends, found)
    above, below, steep, along = found
    steep, along = _exceeded(steep), along / (2 * step)
    along += _more(8 * _BETWEEN_NODES / 6 + _BETWEEN_NODES) * along.max(axis=0)
    across = np.empty_like(along)
    across[1:] = steep[1:] / (step * (np.arange(1, n) - 0.5))[:, None]
    across[0] = along[:2].max(axis=0)
    across = np.minimum(across, np.maximum.accumulate(along, axis=0))
    margin = step * steep.max(axis=0)  # what a part changes between two nodes
    above = np.maximum.accumulate(above[::-1], axis=0)[::-1] + margin
    below = np.minimum.accumulate(below, axis=0) - margin
    return Envelopes(_with_lanes(np.stack([above, below, steep, np.maximum(along, across), along + across])), 1 / step)


def _with_lanes(values: FloatArray) -> FloatArray:
    """The parts, ndarray[..., n_parts], and more that are nothing, up to the number that compiled loops expect."""
    found = np.zeros((*values.shape[:-1], BOUNDED))
    found[..., : values.shape[-1]] = values
    return found


def _largest_near(values: FloatArray, reach: int) -> FloatArray:
    """The largest of each row and up to so many before and behind it; ndarray[n, n_parts]."""
    largest, span, width = np.pad(values, ((reach, reach), (0, 0)), mode="edge"), 1, 2 * reach + 1
    while 2 * span <= width:
        largest, span = np.maximum(largest[:-span], largest[span:]), 2 * span
    return np.asarray(np.maximum(largest[: len(values)], largest[width - span :]))


class Deviation(NamedTuple):
    """How far the kernel in cells of places may be from its interpolation through their nodes.

    `kernel`: ndarray[n_cells, n_channels, n_channels, n_bands], and `moves`, ndarray[n_cells, n_channels, 3], for a
    light whose interpolation differs by up to 1 from its mean at the nodes, has a slope of up to 1 per pixel, or a
    second derivative of up to 1.
    """

    kernel: FloatArray
    moves: FloatArray


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
        self._images = SHARP if profile is None else _envelopes(profile, self._pitch_um, self._middle, self._ends)
        self._nearby: dict[float, Envelopes] = {}
        # What each pixel of a channel takes of the light through each channel's filter: mean, and by how much of it
        # pixels differ.
        taken = crosstalk.taken(view.mosaic, self._share)
        own = [taken[view.mosaic.indices == to] for to in range(n)]
        self._taken = np.stack([pixels.mean(axis=0) for pixels in own])
        apart = np.stack([np.abs(pixels - pixels.mean(axis=0)).max(axis=0) for pixels in own])
        self.uneven = np.divide(apart, self._taken, out=np.zeros_like(apart), where=self._taken > 0)

    def _near(self, h: float) -> Envelopes:
        """The envelopes for cells of half width `h`: slopes are those of all radii that a piece of an edge may have."""
        if self._is_sharp:
            return SHARP
        if h not in self._nearby:
            images, table = self._images, self._images.table.copy()
            piece, pixel = math.hypot(h, h + self._half / SEGMENTS), math.sqrt(2) * (h + self._half)
            for which, reach_px in ((STEEP, piece), (BENT, piece), (INNER, pixel)):
                table[which] = _largest_near(images.table[which], 1 + math.ceil(reach_px * images.per_px))
            self._nearby[h] = images._replace(table=table)
        return self._nearby[h]

    @property
    def n_parts(self) -> int:
        """Parts of the light that are bounded apart: all of it as at the middle wavelength, and the rest by band."""
        return len(self._ends)

    def amounts(self, light: FloatArray, first: IndexArray, second: IndexArray) -> FloatArray:
        """Size of each part of the difference of two lights, ndarray[n_pairs, n_channels, n_parts].

        `light`: ndarray[n, n_channels, n_wavelengths] (of the scene's grid); `first`, `second`: of each pair.
        """
        found = np.zeros((first.size, light.shape[1], self.n_parts))
        band = np.searchsorted(self._knots_nm[self._ends[1:-1]], self._view.grid.nodes_nm)
        amounts_of_pairs(light, first, second, 1 + band, found)
        return found

    def ranges(self, kernels: FloatArray, shares: FloatArray) -> FloatArray:
        """Range of each part of kernels, ndarray[n, n_channels, n_channels, n_functions] -> ndarray[2, n, n_channels,
        n_channels, n_parts]; `shares`: how much of each function is at each knot, ndarray[n_functions, n_knots or 1].
        """
        flat = kernels.reshape(-1, len(shares))
        middle, lit = min(self._middle, shares.shape[1] - 1), np.flatnonzero(flat.any(axis=1))
        found = np.zeros((2, len(flat), self.n_parts))
        for start in range(0, lit.size, _AT_ONCE):
            some = lit[start : start + _AT_ONCE]
            own = np.empty((2, some.size, self.n_parts))
            ranges(flat[some] @ shares, middle, self._ends, own)
            found[:, some] = own
        return found.reshape(2, *kernels.shape[:-1], self.n_parts)

    def bounds(
        self, centers: FloatArray, h: float, homes: FloatArray, sums: FloatArray, low: FloatArray, high: FloatArray
    ) -> CellBounds:
        """What channels have in cells, before it is related to the sums of their weights.

        `sums`: of the weights of each channel's pixels at the nodes, ndarray[n, 9, n_channels]; `low`, `high`: range of
        the kernel over these, ndarray[n, n_channels, n_channels, n_parts].

        See the head of this file. Of a ratio k = M / D with the interpolation i, k - i is dev(M - i D) / D, and
        dev(M - r D), with the mean r of i, the sum of dev(weight x (light - r)) over the pixels.
        """
        mosaic, n = self._view.mosaic, len(centers)
        seen = sampling.window(mosaic, centers, self._reach)
        weights = np.empty((0, 0, 0))
        if self._target.readout == "center":  # the weights of a demosaicked pixel are the same in the whole cell
            weights = demosaic.center_weights(seen, homes - centers, self._methods.demosaic, mosaic)
        sizes = self._half, self._radii[0], self._share
        light = Light(*self._near(h), *sizes, self._taken, not self.uneven.any())
        nodes = _with_lanes(np.stack([low, high], axis=1))
        found, moves = np.empty(nodes[:, 0].shape), np.empty((n, len(mosaic.channels), 3))
        deviations(seen.columns, seen.rows, seen.channel, weights, light, self._radii[1], h, nodes, found, moves)
        return CellBounds(found[..., : low.shape[-1]], sums, moves, low, high)


def of_channels(
    bounds: CellBounds, uneven: FloatArray, rows: IndexArray, which: IndexArray, channel: IndexArray
) -> Deviation:
    """Of the channels that classes of pixels are in: see `compiled_classes.deviations_of_channels`."""
    n = int(channel.max()) + 1
    kernels = np.empty((len(rows), n, n, bounds.sizes.shape[3]))
    moves = np.empty((len(rows), n, 3))
    deviations_of_channels(bounds, uneven, rows, which, channel, kernels, moves)
    return Deviation(kernels, moves)
