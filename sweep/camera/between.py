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
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter1d

from ..types import BoolArray, FloatArray, IndexArray
from . import kernel
from .effects import blur, crosstalk, demosaic, phase, sampling
from .methods import Methods
from .view import View

_SEGMENTS = 8
"""Parts of a pixel's edge over which the image's slope is bounded one by one."""
_BETWEEN_NODES = (math.pi / 12) ** 2 / 8
"""A function of one highest frequency, at 24 nodes per period of it, exceeds its nodes by at most this much of its
largest value (Bernstein: its second derivative is at most the square of that frequency times this value)."""
_BANDS = 12
"""Bands of wavelengths in which the light is bounded apart."""
_AT_ONCE = 400_000
"""Values of pixels and edges that are held at once."""


@dataclass(frozen=True)
class _Slopes:
    """A pixel's covered area or light over a cell: its range, and along both axes the largest slope, how much of the
    slope's change is sudden (`jump`) and how much is at most proportional to the way (`bend`)."""

    low: FloatArray
    high: FloatArray
    slope: tuple[FloatArray, FloatArray]
    jump: tuple[FloatArray, FloatArray]
    bend: tuple[FloatArray, FloatArray]

    def part(self, number: int) -> _Slopes:
        """One part of the light."""
        each = ((a[number], b[number]) for a, b in (self.slope, self.jump, self.bend))
        return _Slopes(self.low[number], self.high[number], *each)

    def at(self, which: IndexArray, turned: BoolArray) -> _Slopes:
        """Of some pixels, by number, those that are `turned` with the axes exchanged."""
        values = [(a[which], b[which]) for a, b in (self.slope, self.jump, self.bend)]
        each = ((np.where(turned, b, a), np.where(turned, a, b)) for a, b in values)
        return _Slopes(self.low[which], self.high[which], *each)


def _overlap(y: FloatArray, half: float, reach: FloatArray) -> FloatArray:
    """Length of y - half..y + half that lies in -reach..reach."""
    return np.asarray(np.maximum(0.0, np.minimum(y + half, reach) - np.maximum(y - half, -reach)), dtype=float)


def _of_disc(dx: FloatArray, dy: FloatArray, half: float, radius: float, h: float) -> _Slopes:
    """Of the share of a pixel that a sharp disc covers, in a cell of half width `h` around (dx, dy)."""
    ax, ay = np.abs(dx), np.abs(dy)
    near, far = [np.maximum(a - h, 0.0) for a in (ax, ay)], [ax + h, ay + h]
    area = 4 * half**2
    slopes, jumps = [], []
    for along, across in ((dx, ay), (dy, ax)):
        low, high, sudden = [], [], []
        for side in (-half, half):
            edge = np.abs(along + side)
            chords = [np.sqrt(np.maximum(radius**2 - e**2, 0.0)) for e in (np.maximum(edge - h, 0.0), edge + h)]
            high.append(_overlap(np.maximum(across - h, 0.0), half, chords[0]))
            low.append(_overlap(across + h, half, chords[1]))
            sudden.append(_overlap(across, half + h, chords[0]) - _overlap(across, half + h, chords[1]))
        slopes.append(np.maximum(high[0] - low[1], high[1] - low[0]) / area)
        jumps.append((sudden[0] + sudden[1]) / area)
    low_share, high_share = (sampling.covered(x, y, half, radius) for x, y in (far, near))
    nothing = np.zeros_like(ax)
    return _Slopes(low_share, high_share, (slopes[0], slopes[1]), (jumps[0], jumps[1]), (nothing, nothing))


class _Images:
    """Envelopes of parts of a blurred image, as functions of the radius; a part is one wavelength or several."""

    def __init__(self, profile: blur.Profile, pitch_um: float, parts: list[tuple[FloatArray, FloatArray]]) -> None:
        """`parts`: values and slopes at the profile's radii, ndarray[n_radii, n_wavelengths] each."""
        self._step = float(profile.r_um[1]) / pitch_um
        steep = np.stack([np.abs(slopes).max(axis=1) for _, slopes in parts])
        self._steep = (steep + _BETWEEN_NODES * steep.max(axis=1, keepdims=True)) * pitch_um
        margin = self._step * self._steep.max(axis=1, keepdims=True)  # what a part changes between two nodes
        above, below = (np.stack([f(values, axis=1) for values, _ in parts]) for f in (np.max, np.min))
        self._above = np.maximum.accumulate(above[:, ::-1], axis=1)[:, ::-1] + margin
        self._below = np.minimum.accumulate(below, axis=1) - margin

    def _node(self, r: FloatArray) -> IndexArray:
        """The node nearest to a radius."""
        return np.asarray(np.minimum(r / self._step + 0.5, self._steep.shape[1] - 1).astype(np.intp))

    def of_pixels(self, dx: FloatArray, dy: FloatArray, half: float, h: float) -> _Slopes:
        """Of the mean over a pixel, in a cell of half width `h` around (dx, dy), ndarray[n] -> ndarray[n_parts, n]."""
        ax, ay = np.abs(dx), np.abs(dy)
        piece = 2 * half / _SEGMENTS
        within = math.hypot(h, h + piece / 2)
        width = 3 + 2 * math.ceil(within / self._step)
        steep = maximum_filter1d(self._steep, width, axis=1, mode="nearest")
        middles = (np.arange(_SEGMENTS) + 0.5) * piece - half
        slopes, bends = [], []
        for along, across in ((dx, dy), (dy, dx)):
            slope, bend = np.zeros((2, len(steep), dx.size))
            edges = [np.abs(along - half), np.abs(along + half)]
            for middle in middles:
                away = np.abs(across + middle)
                ends = []
                for edge in edges:
                    # Of this piece of the edge, wherever the light is in the cell: nearest and furthest radius.
                    low_r = np.hypot(np.maximum(edge - h, 0.0), np.maximum(away - piece / 2 - h, 0.0))
                    high_r = np.hypot(edge + h, away + piece / 2 + h)
                    ends.append((self._below[:, self._node(high_r)], self._above[:, self._node(low_r)]))
                    towards = np.minimum(1.0, (edge + h) / np.maximum(low_r, 1e-9))
                    bend += steep[:, self._node(np.hypot(edge, away))] * towards
                slope += np.maximum(ends[0][1] - ends[1][0], ends[1][1] - ends[0][0])
            slopes.append(slope / (_SEGMENTS * 2 * half))
            bends.append(bend / (_SEGMENTS * 2 * half))
        nearest = np.hypot(np.maximum(ax - half - h, 0.0), np.maximum(ay - half - h, 0.0))
        low = self._below[:, self._node(np.hypot(ax + half + h, ay + half + h))]
        nothing = np.zeros_like(low)
        high = self._above[:, self._node(nearest)]
        return _Slopes(low, high, (slopes[0], slopes[1]), (nothing, nothing), (bends[0], bends[1]))


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
        self._images = None if profile is None else self._images_of(profile)
        # What each pixel of a channel takes of the light through each channel's filter: mean, and largest deviation.
        whole = (view.mosaic.indices[..., None] == np.arange(n)).astype(float)
        taken = crosstalk.mixed(whole[None], self._share, periodic=True)[0]
        own = [taken[whole[..., to] > 0] for to in range(n)]
        self._taken = np.stack([pixels.mean(axis=0) for pixels in own])
        self._uneven = np.stack([np.abs(pixels - pixels.mean(axis=0)).max(axis=0) for pixels in own])

    def _images_of(self, profile: blur.Profile) -> _Images:
        """That at the middle wavelength, and what differs from it in each band."""
        values, slopes = profile.values, profile.slopes
        middle = slice(self._middle, self._middle + 1)
        parts = [(values[:, middle], slopes[:, middle])]
        for a, b in pairwise(self._ends):
            some = slice(a, b + 1)
            parts.append((values[:, some] - values[:, middle], slopes[:, some] - slopes[:, middle]))
        return _Images(profile, self._pitch_um, parts)

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
        return np.concatenate([whole, np.abs(light) @ np.eye(self.n_parts - 1)[band]], axis=-1)

    def _kernel_ranges(self, corners: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
        """Range over the corners of each part of the kernel, ndarray[n, n_channels, n_channels] each."""
        if self._images is None:
            return [(corners[..., 0].min(axis=1), corners[..., 0].max(axis=1))]
        middle = corners[..., self._middle : self._middle + 1]
        parts = [middle, *(corners[..., a : b + 1] - middle for a, b in pairwise(self._ends))]
        return [(part.min(axis=(1, 4)), part.max(axis=(1, 4))) for part in parts]

    def of_cells(self, centers: FloatArray, h: float, homes: FloatArray, corners: FloatArray) -> Deviation:
        """Bounds for cells of half width `h` around `centers` (ndarray[n, 2]), read out at `homes` (ndarray[n, 2]).

        `corners`: kernel at their corners, ndarray[n, 4, n_channels, n_channels, n_knots or 1].
        """
        step = max(1, _AT_ONCE // (kernel.pixels_per_place(self._view) * len(self._view.mosaic.channels)))
        of = self._of_center if self._target.readout == "center" else self._of_mean
        parts = [
            of(centers[at : at + step], h, homes[at : at + step], corners[at : at + step])
            for at in range(0, len(centers), step)
        ]
        return Deviation(np.concatenate([p.kernel for p in parts]), np.concatenate([p.tilt for p in parts]))

    def _light(self, places: FloatArray, h: float) -> list[_Slopes]:
        """Of the light of pixels at `places` (ndarray[n_places, 2]) from its center, part by part."""
        if self._images is None:
            return [_of_disc(places[:, 0], places[:, 1], self._half, self._radii[0], h)]
        found = self._images.of_pixels(places[:, 0], places[:, 1], self._half, h)
        return [found.part(part) for part in range(self.n_parts)]

    def _own(self, seen: sampling.Window) -> FloatArray:
        """Which channel is whose, ndarray[rows, columns, n_channels]."""
        return np.asarray(seen.channel[..., None] == np.arange(len(self._view.mosaic.channels)), dtype=float)

    def _of_center(self, centers: FloatArray, h: float, homes: FloatArray, _: FloatArray) -> Deviation:
        """The weights of a demosaicked pixel are the same in the whole cell."""
        seen = sampling.window(self._view.mosaic, centers, self._reach)
        own = self._own(seen)
        weights = demosaic.center_weights(seen, homes - centers, self._methods.demosaic, self._view.mosaic)
        spread = crosstalk.mixed(weights[..., None] * own, self._share)
        wanted = np.asarray((spread > 0).any(axis=3))
        cell, row, column = np.nonzero(wanted)
        places, which = sampling.different(seen, wanted)[:2]
        through = own[row, column].argmax(axis=1)
        light = self._light(places, h)
        found = _summed(spread[wanted], cell, through, which, _bends(light, h), len(centers))
        return Deviation(found, np.zeros(found.shape[:2]))

    def _of_mean(self, centers: FloatArray, h: float, _: FloatArray, corners: FloatArray) -> Deviation:
        """See the head of this file. A ratio k = M / D is that of the interpolations, r, but for dev(M - r D) / D; r is
        a mean of the corners' values, and dev(M - r D) is the sum of dev(weight x (light - r)) over the pixels.
        """
        seen = sampling.window(self._view.mosaic, centers, self._reach)
        own = self._own(seen)
        area = _of_disc(seen.dx, seen.dy, self._half, self._radii[1], h)
        sudden = area.jump[0] + area.jump[1]
        each = (area.high, *area.slope, sudden)
        mixed = [crosstalk.mixed(values[..., None] * own, self._share) for values in each]
        wanted = np.asarray((mixed[0] > 0).any(axis=3))
        weight, slope_x, slope_y, jump = (values[wanted] for values in mixed)  # [n_pixels, n_channels]
        cell, row, column = np.nonzero(wanted)
        through = own[row, column].argmax(axis=1)
        sums = np.einsum("nrc,rcu->nu", sudden, own) * h / 2
        readout = self._radii[1]
        shares = [sampling.covered(seen.dx - h * x, seen.dy - h * y, self._half, readout) for x, y in phase.CORNERS]
        at_corners = np.stack([np.einsum("nrc,rcu->nu", share, own) for share in shares], axis=1)
        least = np.maximum(at_corners.min(axis=1) - sums, 1e-300)
        places, which, turned = sampling.different(seen, wanted)
        lights = self._light(places, h)
        found = _summed(weight, cell, through, which, _bends(lights, h), len(centers))
        # Elsewhere than at the rim of the readout the weights are the same in the whole cell.
        rim = np.flatnonzero((slope_x > 0).any(axis=1) | (slope_y > 0).any(axis=1) | (jump > 0).any(axis=1))
        at, to, taken = cell[rim], through[rim], self._taken.T[through[rim]]
        for part, (all_light, (low, high)) in enumerate(zip(lights, self._kernel_ranges(corners), strict=True)):
            light = all_light.at(which[rim], turned[rim])
            # The ratio, for a weight that goes through one channel's filter alone.
            k_low, k_high = (
                np.divide(k[at, :, to], taken, out=np.zeros_like(taken), where=taken > 0) for k in (low, high)
            )
            every = jump[rim] * np.maximum(light.high[:, None] - k_low, k_high - light.low[:, None]) * (h / 2)
            every += (slope_x[rim] * light.slope[0][:, None] + slope_y[rim] * light.slope[1][:, None]) * h**2
            np.add.at(found[..., part].swapaxes(1, 2), (at, to), every)
            size = np.maximum(np.abs(low), np.abs(high)) / np.where(self._taken > 0, self._taken, np.inf)
            found[..., part] += size * self._uneven * sums[:, :, None]
        spread = at_corners.max(axis=1) - at_corners.min(axis=1)
        return Deviation(found / least[:, :, None, None], spread / np.maximum(at_corners.min(axis=1), 1e-300))


def _bends(lights: list[_Slopes], h: float) -> FloatArray:
    """How far each part of the light may be from the line between two ends of a cell, ndarray[n_places, n_parts]."""
    each = [(a.bend[0] + a.bend[1]) * h**2 / 2 + (a.jump[0] + a.jump[1]) * h / 2 for a in lights]
    return np.stack(each, axis=1)


def _summed(
    weights: FloatArray, cell: IndexArray, through: IndexArray, place: IndexArray, values: FloatArray, n_cells: int
) -> FloatArray:
    """Sums of values at places, ndarray[n_places, n_parts], over the pixels of each cell that look through a channel.

    `weights`: ndarray[n_pixels, n_channels]. Returns ndarray[n_cells, n_channels, n_channels, n_parts].
    """
    n, n_places = weights.shape[1], len(values)
    at = (cell * n + through) * n_places + place
    sums = [np.bincount(at, own, minlength=n_cells * n * n_places).reshape(-1, n_places) @ values for own in weights.T]
    return np.stack([each.reshape(n_cells, n, -1) for each in sums], axis=1)
