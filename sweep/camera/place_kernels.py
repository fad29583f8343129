"""Kernels at many places of a light: what `kernel.make_kernel` gives for the channels, made for thousands of places.

The image at every wavelength is a sum of a few functions of the radius (`encircled`), so that for each pixel much less
than a value per wavelength is computed.
"""

from __future__ import annotations

from collections import Counter

import numpy as np

from ..base.types import FloatArray
from . import compiled_light, legendre
from .compiled_pixels import kernels_by_ring
from .effects import crosstalk, demosaic, phase, sampling
from .encircled import encircled
from .kernel import profile_of
from .kernel_size import pixels_per_place
from .methods import Methods
from .pixel_light import edge_rule, rings
from .view import View

_AT_ONCE = 1_000_000
"""Pixels that are held at once."""
_SHARP: compiled_light.Table = (np.empty((0, 0)), 0.0)


class PlaceKernels:
    """Kernels at places, for one way to compute a scene's light at some wavelengths."""

    def __init__(self, view: View, methods: Methods, knots_nm: FloatArray, *, many: bool = False) -> None:
        """`many`: so many places are asked for that a table of the light of all pixels pays (`pixel_light`)."""
        target, pixel = view.scenario.target, view.pixel
        assert target is not None
        self._view, self._methods, self._target = view, methods, target
        self._half = pixel.fill_factor**0.5 / 2
        self._radii = sampling.radii_px(view, target)
        self._share = crosstalk.share(view, methods.crosstalk)
        profile = profile_of(view, methods, knots_nm)
        self._table, self._rule, self._rings = _SHARP, legendre.rule(1), None
        self.shares = np.ones((1, knots_nm.size))
        if profile is not None:
            light = encircled(profile)
            self._table = light.coefficients, pixel.pitch_um / float(profile.r_um[1])
            self.shares = light.shares
            self._rule = edge_rule(profile, self._half * pixel.pitch_um)
            self._rings = rings(profile, self._half, pixel.pitch_um) if many else None

    def at(self, cases: phase.Cases, work: Counter[str]) -> tuple[FloatArray, FloatArray]:
        """What each channel gets through each channel's filter of each function of the light, ndarray[n_cases,
        n_channels, n_channels, n_functions]; times `shares`, ndarray[n_functions, n_knots], at each wavelength. And
        the sum of weights of each channel's pixels, ndarray[n_cases, n_channels].
        """
        step = max(1, _AT_ONCE // pixels_per_place(self._view))
        starts = range(0, len(cases.places_px), step)
        blocks = [self._of_block(cases.some(slice(at, at + step)), work) for at in starts]
        kernels, sums = zip(*blocks, strict=True)
        return np.concatenate(kernels), np.concatenate(sums)

    def _of_block(self, cases: phase.Cases, work: Counter[str]) -> tuple[FloatArray, FloatArray]:
        mosaic = self._view.mosaic
        seen = sampling.window(mosaic, cases.places_px, sampling.reach_px(self._view, self._target))
        x, y = seen.columns, seen.rows
        if self._target.readout == "mean":
            weights = compiled_light.covered_by_disc(x, y, self._half, self._radii[1])
        else:
            weights = demosaic.center_weights(seen, cases.home_px - cases.places_px, self._methods.demosaic, mosaic)
        n = len(mosaic.channels)
        found, sums = np.empty((len(x), n, n, len(self.shares))), np.empty((len(x), n))
        if self._rings is None:
            sizes = (self._half, self._radii[0], self._share)
            compiled_light.kernels(x, y, weights, seen.channel, *sizes, self._table, self._rule, found, sums)
        else:
            by_ring = np.zeros((*found.shape[:3], len(self._rings.shares)))
            kernels_by_ring(x, y, weights, seen.channel, self._share, self._rings, by_ring, sums)
            found = by_ring @ self._rings.shares / sums[:, :, None, None]
        work["sampling"] += weights.size * len(self.shares)
        return found, sums
