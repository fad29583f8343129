"""Kernels at many places of a light: what `kernel.make_kernel` gives for the channels, made for thousands of places.

The image at every wavelength is a sum of a few functions of the radius (`encircled`), so that for each pixel much less
than a value per wavelength is computed.
"""

from __future__ import annotations

from collections import Counter
from functools import cached_property

import numpy as np

from ..base.types import BoolArray, FloatArray, IndexArray
from . import compiled_light, legendre
from .compiled_pixels import kernels_by_ring
from .effects import crosstalk, demosaic, phase, sampling
from .encircled import encircled
from .inner_light import InnerLight, taken_by_channels
from .kernel import profile_of
from .kernel_size import pixels_per_place
from .methods import Methods
from .pixel_light import edge_rule, rings
from .view import View

_AT_ONCE = 1_000_000
"""Pixels that are held at once."""
_BY_RING = 8
"""Places whose light is held at once by the functions of all rings: it stays in the processor's cache."""
_FEW_PER_PIXEL = 16
"""Places that are no multiples of so many parts of a pixel are those of small cells, of which there are many."""
_SHARP: compiled_light.Table = (np.empty((0, 0)), 0.0)


class PlaceKernels:
    """Kernels at places, for one way to compute a scene's light at some wavelengths."""

    def __init__(
        self, view: View, methods: Methods, knots_nm: FloatArray, *, many: bool = False, folded: bool = False
    ) -> None:
        """`many`: so many places are asked for that a table of the light of all pixels pays (`pixel_light`). `folded`:
        all between the center of a pixel and its corner, and every pixel of the tile is a channel of its own.
        """
        target, pixel = view.scenario.target, view.pixel
        assert target is not None
        self._view, self._methods, self._target = view, methods, target
        self._half = pixel.fill_factor**0.5 / 2
        self._radii = sampling.radii_px(view, target)
        self._share = crosstalk.share(view, methods.crosstalk)
        # Channels whose pixels take light through the filter of another one, and that one.
        taken, n = crosstalk.taken(view.mosaic, self._share), len(view.mosaic.channels)
        self._taken = np.argwhere([(taken[view.mosaic.indices == to] > 0).any(axis=0) for to in range(n)])
        profile = profile_of(view, methods, knots_nm)
        self._table, self._rule, self._rings = _SHARP, legendre.rule(1), None
        self.shares = np.ones((1, knots_nm.size))
        self._not_counted = 0 if profile is None else profile.work
        if profile is not None:
            light = encircled(profile)
            self._table = light.coefficients, pixel.pitch_um / float(profile.r_um[1])
            self.shares = light.shares
            self._rule = edge_rule(profile, self._half * pixel.pitch_um)
            self._rings = rings(profile, self._half, pixel.pitch_um) if many else None
            self._finest_per_px = profile.highest_per_um * pixel.pitch_um
        self._has_inner = folded and self._rings is not None and InnerLight.pays(self._half, self._radii[1])

    def at(self, cases: phase.Cases, work: Counter[str]) -> tuple[FloatArray, FloatArray]:
        """What each channel gets through each channel's filter of each function of the light, ndarray[n_cases,
        n_channels, n_channels, n_functions]; times `shares`, ndarray[n_functions, n_knots], at each wavelength. And
        the sum of weights of each channel's pixels, ndarray[n_cases, n_channels].
        """
        work["blur"] += self._not_counted
        self._not_counted = 0
        n, step = len(self._view.mosaic.channels), max(1, _AT_ONCE // pixels_per_place(self._view))
        found, sums = np.empty((len(cases.places_px), n, n, len(self.shares))), np.empty((len(cases.places_px), n))
        # The same way for a place in whatever company it is asked for.
        scaled = cases.places_px * _FEW_PER_PIXEL
        are_many = (scaled != np.floor(scaled)).any(axis=1) & self._has_inner
        for some, inner in ((np.flatnonzero(~are_many), None), (np.flatnonzero(are_many), self._inner)):
            for start in range(0, some.size, step):
                block = some[start : start + step]
                found[block], sums[block] = self._of_block(cases.some(block), inner, work)
        return found, sums

    @cached_property
    def _inner(self) -> InnerLight | None:
        """The light of inner pixels, of a large light."""
        if not self._has_inner:
            return None
        assert self._rings is not None
        return InnerLight(self._rings, self._finest_per_px, self._half, self._radii[1], self._view.mosaic)

    def _of_block(
        self, cases: phase.Cases, inner: InnerLight | None, work: Counter[str]
    ) -> tuple[FloatArray, FloatArray]:
        mosaic = self._view.mosaic
        seen = sampling.window(mosaic, cases.places_px, sampling.reach_px(self._view, self._target))
        x, y = seen.columns, seen.rows
        if self._target.readout == "mean":
            weights = compiled_light.covered_by_disc(x, y, self._half, self._radii[1])
        else:
            weights = demosaic.center_weights(seen, cases.home_px - cases.places_px, self._methods.demosaic, mosaic)
        n = len(mosaic.channels)
        found, sums = np.zeros((len(x), n, n, len(self.shares))), np.empty((len(x), n))
        work["sampling"] += weights.size * len(self.shares)
        if self._rings is None:
            sizes = (self._half, self._radii[0], self._share)
            compiled_light.kernels(x, y, weights, seen.channel, *sizes, self._table, self._rule, found, sums)
            return found, sums
        ring, left_out = 0, np.zeros(seen.channel.shape, dtype=bool)
        if inner is not None:
            ring, left_out = min(int(inner.nearest_px), len(self._rings.sizes) - 1), inner.among(seen, cases.places_px)
        self._by_ring(x, y, weights, seen.channel, left_out, ring, found, sums)
        if inner is not None:
            found += taken_by_channels(mosaic, self._share)[:, :, None] * inner.at(cases.places_px)[:, None]
        found /= sums[:, :, None, None]
        return found, sums

    def _by_ring(
        self,
        x: FloatArray,
        y: FloatArray,
        weights: FloatArray,
        channel: IndexArray,
        left_out: BoolArray,
        ring: int,
        found: FloatArray,
        sums: FloatArray,
    ) -> None:
        """Put what `kernels_by_ring` sums up into `found`, which is nothing before, few places at once."""
        assert self._rings is not None
        to, through = self._taken.T
        pairs = np.full(found.shape[1:3], -1)
        pairs[to, through] = np.arange(len(to))
        shares = self._rings.shares[self._rings.sizes[ring, 4] :]
        room = np.empty((min(_BY_RING, len(x)), len(to), len(shares)))
        for start in range(0, len(x), _BY_RING):
            some = slice(start, start + _BY_RING)
            by_ring = room[: len(x[some])]
            by_ring[:] = 0.0
            own = x[some], y[some], weights[some], channel, left_out
            kernels_by_ring(*own, self._share, self._rings, ring, pairs, by_ring, sums[some])
            found[some, to, through] = (by_ring.reshape(-1, len(shares)) @ shares).reshape(*by_ring.shape[:2], -1)
