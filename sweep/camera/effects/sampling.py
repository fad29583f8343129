"""Mosaic sampling: which pixels a light covers, how much of each, and how they are read out."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...base.cache import Cache
from ...base.types import BoolArray, FloatArray, IndexArray
from .. import legendre
from ..mosaic import Mosaic
from ..scene import Target
from ..shot import Shot
from .base import Chosen, KernelEffect, Load, Part, Stage
from .blur import Profile

PIXEL_S = 3.5e-10
"""Seconds of a pixel at a place of the light, through a channel's filter, at a wavelength."""
SEARCHED_S, SEARCHED_PIXEL_S, PLACE_S, PLACE_PIXEL_S = 0.02, 2.4e-6, 4e-5, 4e-9
"""Seconds that a search for the worst of all places takes: to begin with, at all and for each pixel around the light
and function of its image, and the same for each place; `tests/bench_work.py` measures all of these."""
_LARGE_LIGHT, _SMALL_LIGHT = 0.8, 3.0
"""Of the places of a search, how many a large light needs, and how many more one that is a pixel wide."""
AROUND_PX, MOST_FUNCTIONS = 6.0, 32
"""How many more pixels a search looks at than are read, across, and of how many functions an image is a sum, about."""
_AT_ONCE = 200
_MOST_KEPT = 2_000_000
"""Values of pixels that are kept."""


def covered(x: FloatArray, y: FloatArray, half: float, radius: float) -> FloatArray:
    """Share of a square of half side `half` around (x, y) that lies in the disc of `radius` around 0, exact."""
    from ..compiled_light import covered_shares  # noqa: PLC0415  (compiled: kept off the start-up path)

    x, y = np.broadcast_arrays(x, y)
    return covered_shares(x.ravel(), y.ravel(), half, radius).reshape(x.shape)


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


def radii_px(shot: Shot, target: Target) -> tuple[float, float]:
    """Radius of the light and of the readout, in pixels; a readout reaches a pixel of every channel."""
    radius = target.object_resolution_px / 2
    rows, columns = shot.mosaic.indices.shape
    return radius, max(radius, math.hypot(rows, columns) / 2)


def reach_px(shot: Shot, target: Target) -> float:
    """How far from the light's center a pixel may have a weight in the readout, along a row or column."""
    if target.readout == "mean":
        return radii_px(shot, target)[1] + 0.5
    return float(max(shot.mosaic.indices.shape))


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
    from ..compiled_light import covered_by_disc  # noqa: PLC0415  (compiled: kept off the start-up path)

    weights = covered_by_disc(seen.columns, seen.rows, half, readout_px)
    for channel in range(n_channels):
        own = seen.channel == channel
        weights[:, own] /= weights[:, own].sum(axis=1, keepdims=True)
    return weights


@dataclass(frozen=True)
class PixelLight:
    """Light of pixels relative to a uniform field, each different place once.

    `values`: of each function of the light, ndarray[n_places, n_functions], the last place is dark; `place`:
    ndarray[n_cases, rows, columns]. `shares`: how much of each function is in each wavelength, ndarray[n_functions,
    n_wavelengths]; None where all wavelengths see the same, and are one function.
    """

    values: FloatArray
    place: IndexArray
    shares: FloatArray | None

    def by_pixel(self) -> FloatArray:
        """ndarray[n_cases, rows, columns, n_wavelengths or 1]."""
        return self._at_wavelengths(self.values)[self.place]

    def folded(self, weights: FloatArray) -> FloatArray:
        """Weighted sums over the pixels: ndarray[n_cases, rows, columns, n] -> ndarray[n_cases, n, n_wavelengths]."""
        found = np.empty((len(weights), weights.shape[-1], self.values.shape[1]))
        for case, own in enumerate(weights):
            some = np.flatnonzero(own.any(axis=2))
            found[case] = own.reshape(-1, own.shape[2])[some].T @ self.values[self.place[case].ravel()[some]]
        return self._at_wavelengths(found)

    def _at_wavelengths(self, values: FloatArray) -> FloatArray:
        return values if self.shares is None else np.asarray(values @ self.shares)


def different(seen: Window, wanted: BoolArray) -> tuple[FloatArray, IndexArray, BoolArray]:
    """Where the pixels that are `wanted` lie from the light's center: the image is round, so mirrored places are one.

    The different places, ndarray[n_places, 2], the shorter distance first; that of each pixel; and whether its shorter
    distance is `dy`, ndarray[n_wanted] each.
    """
    x, y = seen.dx[:, 0, :], seen.dy[:, :, 0]
    along = np.round(np.abs(np.concatenate([x.ravel(), y.ravel()])), 12)
    distances, which = np.unique(along, return_inverse=True)
    case, row, column = np.nonzero(wanted)
    of_x, of_y = which[: x.size].reshape(x.shape)[case, column], which[x.size :].reshape(y.shape)[case, row]
    named, place = np.unique(np.minimum(of_x, of_y) * distances.size + np.maximum(of_x, of_y), return_inverse=True)
    return distances[np.stack(np.divmod(named, distances.size), axis=1)], place, of_y < of_x


def light_on_pixels(
    seen: Window, wanted: BoolArray, half: float, radius_px: float, profile: Profile | None, pitch_um: float
) -> PixelLight:
    """The light of the pixels that are `wanted` (ndarray[n_cases, rows, columns]); the others are dark.

    Without a profile the image is sharp. The mean of the profile over the pixel is a Gauss-Legendre rule, whose order
    follows the size of the pixel in periods of the highest frequency.
    """
    apart, inverse, _ = different(seen, wanted)
    place = np.full(wanted.shape, len(apart))
    place[wanted] = inverse
    if profile is None:
        values = covered(apart[:, 0], apart[:, 1], half, radius_px)[:, None]
    else:
        values = _means(apart, half, profile, pitch_um)
    shares = None if profile is None else profile.shares
    return PixelLight(np.vstack([values, np.zeros((1, values.shape[1]))]), place, shares)


MEANS: Cache[tuple[Profile, float, bytes], FloatArray] = Cache(4)
"""The latest pixels: CFAs with tiles of one size look at the same around a light that may fall anywhere."""


def _means(apart: FloatArray, half: float, profile: Profile, pitch_um: float) -> FloatArray:
    """Mean of the profile's functions over pixels at `apart` (ndarray[n, 2]) from its center, [n, n_functions]."""
    if len(apart) * len(profile.shares) > _MOST_KEPT:
        return _made_means(apart, half, profile, pitch_um)
    key = (profile, half * pitch_um, apart.tobytes())
    return MEANS.get(key, lambda: _made_means(apart, half, profile, pitch_um))


def _made_means(apart: FloatArray, half: float, profile: Profile, pitch_um: float) -> FloatArray:
    nodes, weights = legendre.rule(profile.order(2 * half * pitch_um))
    u, v = (a.ravel() * half for a in np.meshgrid(nodes, nodes))
    both = np.outer(weights, weights).ravel() / 4
    values = np.empty((len(apart), len(profile.shares)))
    for start in range(0, len(apart), _AT_ONCE):
        x, y = apart[start : start + _AT_ONCE].T
        r = np.sqrt((x[:, None] + u) ** 2 + (y[:, None] + v) ** 2) * pitch_um
        values[start : start + _AT_ONCE] = profile.sums(r, both)
    return values


def searched_places(of_any: float, across_px: float) -> float:
    """About how many places a search looks at, of a light of a size; `of_any`: whatever its size (`phase.AT_ALL`)."""
    return of_any * (_LARGE_LIGHT + _SMALL_LIGHT / across_px)


class Sampling(KernelEffect):
    """Pixels, one by one, in place of the mean over the whole readout."""

    name = "sampling"
    methods = ("skip", "pixels")
    stage = Stage.SAMPLING
    order = 1
    needed_for_noise = True
    part = Part.PIXELS

    def exact(self, shot: Shot) -> str | None:
        """A light that fills the field needs no pixels."""
        return "every pixel of a channel sees the same" if shot.scenario.target is None else None

    def allowed(self, shot: Shot, methods: Chosen) -> bool:
        """Without pixels nothing saturates or is rounded one by one."""
        return methods.sampling != "skip" or methods.straight

    def work(self, shot: Shot, methods: Chosen, load: Load) -> Load:
        """The light of every pixel at every place, and what reads it."""
        target = shot.scenario.target
        if target is None or methods.sampling == "skip":
            return load
        across = 2 * radii_px(shot, target)[1] + 1
        pixels = max(across, 2.0 * max(shot.mosaic.indices.shape)) ** 2
        apart = shot.grid.size if not methods.straight else load.knots
        shared_s, own_s = load.shared_s, PIXEL_S * load.cases * pixels * len(shot.mosaic.channels) * apart
        if load.searched:
            around = (across + AROUND_PX) ** 2 * min(load.knots, MOST_FUNCTIONS)
            places_s = searched_places(load.searched, across) * (PLACE_S + PLACE_PIXEL_S * around)
            own_s += SEARCHED_S + SEARCHED_PIXEL_S * around + places_s / 2
            shared_s += places_s / 2  # CFAs whose tiles are alike look at about half of their places together
        units = load.units if methods.straight else pixels
        return load._replace(units=units, own_s=load.own_s + own_s, shared_s=shared_s)
