"""Brightness curves: the readings of each lamp over its brightness, in one case of a scene.

A lamp of brightness a, relative to that of the scene, sends a times its electrons to each pixel; full well, captures,
merge and noise follow. The curve is smooth but for a knee wherever a pixel fills or hands over to its next capture.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, cast

import numpy as np

from ..base.types import (
    Array,
    Bool,
    BoolArray,
    DesignSignals,
    Float,
    FloatArray,
    IndexArray,
    Int,
    PerChannel,
    PerDesign,
    PerValue,
)
from .effects import any_filter
from .noise.law import Law, groups_of, knees_of, law_of, pixel_law, stacked, unclipped_e
from .noise.merge import exposure_of, merged, without_noise
from .pixel import Pixel, unquantized
from .setup import Setup

if TYPE_CHECKING:
    from .noise.law_kernels import Lamps

_LEAST_E = 0.05
"""Electrons of the brightest pixel at the dimmest node beside dark."""
_RATIO, _RATIO_OF_MANY = 1.25, 1.06
"""Ratio of neighboring nodes, and from where the first of many pixels is full."""
_AROUND_KNEE = 6
"""Standard deviations of the noise on either side of a knee, of which each half has a node."""
_BEYOND = 1.1
"""Brightness of the last node, relative to those around the last knee."""
_BESIDE = 1e-9
"""Nodes beside a knee without noise, where the reading may jump, relative."""
_FEW, _MOST_KNEES = 16, 32
"""Pixels around whose knees nodes are, and knees of many pixels that are nodes."""
_EQUAL, _DIGITS = 1e-9, 10
"""Relative difference, and digits, to which light of exposures is the same."""
_SEEN = 1e-4
"""Weight of a pixel in a channel, relative to the largest, below which its knees are not waited for."""
_MOST_RATIO = 1e9
"""A pixel that so much more light would not fill is not waited for."""


@dataclass(frozen=True)
class LampReadings:
    """Electrons of the lamps of a design in one case, and how they are read.

    `lit_e` and `dark_e`: electrons of the lamps at the brightness of the scene, and without lamps. `light`: of the
    exposures on the elements, relative to a pixel of full sensitivity; `proportional`: all exposures have their fixed
    share of the electrons. `weights`, `spread_weights`: of elements in mean and variance of the channels. Pixels with
    the same light are one element; `n_pixels` counts all pixels. `cases`: numbers of the cases that differ from this
    one in the brightness of all lamps alone, `scales`.
    """

    lit_e: Float[Array, "captures signals pixels"]
    dark_e: Float[Array, "captures pixels"]
    light: Float[Array, "captures pixels"]
    weights: Float[Array, "pixels channels"]
    spread_weights: Float[Array, "pixels channels"]
    pixel: Pixel
    noisy: bool
    proportional: bool
    n_pixels: int
    cases: Sequence[int] = (0,)
    scales: Sequence[float] = (1.0,)

    @property
    def n_signals(self) -> int:
        """Number of lamps."""
        return len(self.lit_e[0])

    def times(self, factors: PerChannel) -> LampReadings:
        """Return the lamps with each channel's readings multiplied."""
        return replace(self, weights=self.weights * factors, spread_weights=self.spread_weights * factors**2)

    def of_cases(self) -> list[LampReadings]:
        """Return the lamps of each case."""
        cases = zip(self.cases, self.scales, strict=True)
        return [replace(self, lit_e=scale * self.lit_e, cases=(case,), scales=(1.0,)) for case, scale in cases]

    @property
    def full_e(self) -> tuple[Float[Array, "signals pixels"], Float[Array, " pixels"]]:
        """Electrons of a pixel of full sensitivity, of the lamps and without them."""
        return self.lit_e[0] / self.light[0], self.dark_e[0] / self.light[0]

    @property
    def full(self) -> Bool[BoolArray, " signals"]:
        """True for lamps that fill a pixel of any channel, of an HDR pixel all its captures."""
        lit_e, dark_e = self.full_e
        full = np.zeros(self.n_signals, dtype=bool)
        for light, at in groups_of(self.light):
            seen = at[self.weights.max(axis=1)[at] > _SEEN * self.weights.max()]
            full |= (lit_e[:, seen] + dark_e[seen] >= knees_of(self.pixel, light)[-1]).any(axis=1)
        return full

    def moments(
        self, signals: Int[IndexArray, " signals"], factors: Float[Array, "signals factors"]
    ) -> tuple[Float[Array, "signals factors channels"], Float[Array, "signals factors channels"]]:
        """Return mean, DN, and variance, DN^2, of each channel.

        `factors`: brightnesses of each of the `signals`.
        """
        if self.proportional:
            from .noise.law_kernels import read_lamps  # noqa: PLC0415  (compiled: kept off the start-up path)

            mean, variance = np.empty((2, factors.size, self.weights.shape[1]))
            read_lamps(self.in_kernels, signals, np.ascontiguousarray(factors, dtype=float), mean, variance)
            return mean.reshape(*factors.shape, -1), variance.reshape(*factors.shape, -1)
        electrons = self.lit_e[:, signals, None] * factors[..., None] + self.dark_e[:, None, None]
        pixel, light = self.pixel, self.light[:, None, None]
        if self.noisy:
            values = merged(electrons, light, pixel)
            mean, variance = values.mean, values.variance
        else:
            mean = without_noise(electrons, light, pixel, rounds=False)
            variance = np.zeros(mean.shape)
        return mean @ self.weights, variance @ self.spread_weights

    def by_electrons(
        self, signals: Int[IndexArray, " values"], factors: PerValue
    ) -> tuple[Float[Array, "values channels"], Float[Array, "values channels"]]:
        """Return derivatives of mean and variance of lamps, each at one brightness, by the electrons of each element.

        Of a pixel of full sensitivity; all exposures have their fixed share of the light.
        """
        lit_e, dark_e = self.full_e
        full_e = lit_e[signals] * factors[:, None] + dark_e
        by_mean, by_variance = np.empty(full_e.shape), np.empty(full_e.shape)
        law, groups = self.law
        for number, (_, at) in enumerate(groups):
            by_mean[:, at], by_variance[:, at] = law.at(number, full_e[:, at])[2:]
        return by_mean, by_variance

    def along(
        self, signals: Int[IndexArray, " values"], factors: PerValue
    ) -> tuple[Float[Array, "values channels"], ...]:
        """Return mean and variance of lamps, each at one brightness, and their derivatives by it."""
        mean, variance = (values[:, 0] for values in self.moments(signals, factors[:, None]))
        by_mean, by_variance = (slopes * self.full_e[0][signals] for slopes in self.by_electrons(signals, factors))
        return mean, variance, by_mean @ self.weights, by_variance @ self.spread_weights

    @property
    def law(self) -> tuple[Law, list[tuple[tuple[float, ...], Int[IndexArray, " _"]]]]:
        """Return what pixels read, a table for the light of each group of elements, and these groups."""
        groups = groups_of(self.light)
        return pixel_law(self.pixel, tuple(light for light, _ in groups), noisy=self.noisy), groups

    @cached_property
    def in_kernels(self) -> Lamps:
        """Lamps as kernels take them, of a pixel's law, or of laws of each channel of each lamp over its brightness."""
        if self.proportional:
            (lit, dark), (law, groups) = self.full_e, self.law
            tables = np.empty((self.n_signals, dark.size), dtype=np.intp)
            for number, (_, at) in enumerate(groups):
                tables[:, at] = number
            weights, squares = self.weights, self.spread_weights
        else:
            law, n = stacked(self._laws_of_brightness()), self.weights.shape[1]
            lit, dark, weights = np.ones((self.n_signals, n)), np.zeros(n), np.eye(n)
            squares, tables = weights, np.arange(self.n_signals * n, dtype=np.intp).reshape(-1, n)
        used = (weights != 0) | (squares != 0)
        only = np.where(used.sum(axis=1) > 1, weights.shape[1], np.where(used.any(axis=1), used.argmax(axis=1), -1))
        arrays = lit, dark, tables, *law, weights, squares, only
        return cast("Lamps", tuple(map(np.ascontiguousarray, arrays)))

    def _laws_of_brightness(self) -> list[Law]:
        """Return the law of each channel of each lamp over its brightness, through values at `_nodes`."""
        from scipy.interpolate import PchipInterpolator  # noqa: PLC0415  (slow to import: kept off the start-up path)

        laws = []
        for signal, own in enumerate(self._nodes()):
            nodes = np.unique(np.append(0.0, own))
            moments = self.moments(np.array([signal]), nodes[None])
            for mean, variance in zip(moments[0][0].T, moments[1][0].T, strict=True):
                values = np.stack([mean, variance])
                laws.append(law_of(nodes, values, PchipInterpolator(nodes, values, axis=1)(nodes, 1)))
        return laws

    def means_of_exposures(self, factors: Float[Array, "signals factors"]) -> Float[Array, "factors _ channels"]:
        """Return the means of all lamps, each exposure with its own share of their light.

        `factors`: light of each exposure relative to that of the scene.
        """
        every = np.arange(self.n_signals)
        if np.allclose(factors, factors[:1], _EQUAL, 0.0):
            distinct, which = np.unique(np.round(factors[0], _DIGITS), return_inverse=True)
            means = self.moments(every, np.broadcast_to(distinct, (every.size, distinct.size)))[0]
            return np.moveaxis(means[:, which], 0, 1)
        electrons = self.lit_e[:, None] * factors[:, :, None, None] + self.dark_e[:, None, None]
        pixel, light = self.pixel, self.light[:, None, None]
        dn = merged(electrons, light, pixel).mean if self.noisy else without_noise(electrons, light, pixel)
        return np.asarray(dn @ self.weights, dtype=float)

    def _knee_widths(self, light: tuple[float, ...]) -> Float[Array, " knees"]:
        """Return the noise at each knee relative to its electrons; 0 without noise."""
        pixel = self.pixel
        knees_e, shares = knees_of(pixel, light), [light[at] for at in exposure_of(pixel)]
        if not self.noisy:
            return np.zeros(knees_e.size)
        counts, read_e = knees_e * shares, np.array([capture.read_noise_e for capture in pixel.read_as])
        return np.asarray(np.sqrt(counts + read_e**2) / np.maximum(counts, 1e-9) + pixel.prnu, dtype=float)

    def _nodes(self) -> Float[Array, "signals nodes"]:
        """Return brightnesses between which curves are nearly straight, from dark to all full."""
        lit_e, dark_e = self.full_e
        weights = self.weights
        seen = weights.max(axis=1) > _SEEN * weights.max()
        lit_e, dark_e = lit_e[:, seen], dark_e[seen]
        brightest_e, of_pixels = np.maximum(lit_e.max(axis=1, keepdims=True), 1e-300), self.light[:, seen]
        knees, around = list[FloatArray](), list[FloatArray]()
        deviations = np.linspace(-_AROUND_KNEE, _AROUND_KNEE, 4 * _AROUND_KNEE + 1)
        for light, at in groups_of(of_pixels):
            lit = np.maximum(lit_e[:, at], np.maximum(brightest_e / _MOST_RATIO, 1e-30))
            for knee_e, width in zip(knees_of(self.pixel, light), self._knee_widths(light), strict=True):
                knees.append(np.maximum(knee_e - dark_e[at], 0.0) / lit)
                around.append(knees[-1][..., None] * np.maximum(1 + width * deviations, 0.0))
        at_knees = np.concatenate(knees, axis=1)
        last = np.concatenate(around, axis=1).max(axis=(1, 2))[:, None] * _BEYOND
        first = np.minimum(_LEAST_E / brightest_e, last / 2)
        parts = [np.zeros_like(last), last, last * 1e3]
        if not self.noisy:
            parts += [
                at_knees * (1 - _BESIDE),
                at_knees * (1 + _BESIDE),
                _geometric(first, last, _RATIO),
            ]
        elif self.n_pixels <= _FEW:
            parts += [np.concatenate(around, axis=1).reshape(len(lit_e), -1)]
            parts.append(_geometric(first, last, _RATIO))
        else:
            sampled = np.linspace(0, at_knees.shape[1] - 1, min(at_knees.shape[1], _MOST_KNEES)).round().astype(int)
            parts += [np.sort(at_knees, axis=1)[:, sampled], _geometric(first, last, _RATIO)]
            first_full = np.maximum(0.9 * at_knees.min(axis=1, keepdims=True), first)
            parts.append(_geometric(first_full, last, _RATIO_OF_MANY))
        return np.sort(np.concatenate(parts, axis=1), axis=1)


def _geometric(
    first: Float[Array, "signals 1"], last: Float[Array, "signals 1"], ratio: float
) -> Float[Array, "signals factors"]:
    """Return steps of at most a ratio from the first to the last number of each row, equally many."""
    decades = np.log(np.maximum(last / np.maximum(first, 1e-300), 1.0))
    steps = max(1, int(np.ceil(decades.max() / np.log(ratio))))
    return np.asarray(first * np.exp(decades * np.arange(steps + 1) / steps), dtype=float)


def room_dn(setup: Setup, response: DesignSignals, unlit: Float[Array, "designs channels"]) -> PerDesign:
    """Return the chromatic distance up to which the closed form holds, DN; see `room_of`.

    `response`: readout, DN; `unlit`: without lamps, DN.
    """
    least_dn = (response - unlit[:, None]).max(axis=2).min(axis=1)
    return room_of(setup, response.max(axis=(1, 2)), least_dn, unlit.min(axis=1), unlit.max(axis=1))


def room_of(
    setup: Setup, most_dn: PerDesign, least_dn: PerDesign, darkest_dn: PerDesign, brightest_dn: PerDesign
) -> PerDesign:
    """Return the chromatic distance up to which the closed form holds, DN; negative: nowhere.

    `most_dn`: largest reading, DN; `least_dn`: that of the fullest channel of the darkest lamp alone, DN;
    `darkest_dn`, `brightest_dn`: smallest and largest reading without lamps, DN.
    It holds for no HDR pixel, and within no limits of the brightness. The closed form takes a lamp that is dimmer than
    it is. A brighter one has its fullest channel at least where its brightest pixel is full, so that it is no nearer to
    a reading than that channel lies above the reading.
    """
    pixel, scene = setup.camera.pixel, setup.scene
    if pixel.captures or scene.brightness is not None:
        return np.full(len(most_dn), -np.inf)
    full_e = pixel.saturation_e if scene.noise is None else unclipped_e(pixel)[1]
    full_dn = unquantized(np.array(full_e), pixel) - brightest_dn
    above_dn = most_dn - darkest_dn
    if scene.target is not None or pixel.crosstalk:
        # The mean of a channel is below its brightest pixel, and that is at most what a light has that fills the field.
        full_dn = full_dn * least_dn / any_filter(setup).brightest_signal_dn
    return np.asarray(full_dn - above_dn, dtype=float)


@dataclass(frozen=True)
class LampSlopes:
    """Readings of the lamps of a design in one case, with derivatives by its free parameters.

    `lit_by_u` and `dark_by_u`: those of the electrons of a
    pixel of full sensitivity.
    """

    lamps: LampReadings
    lit_by_u: Float[Array, "free *captures signals pixels"]
    dark_by_u: Float[Array, "free *captures pixels"]

    def moments(
        self, signals: Int[IndexArray, " values"], factors: PerValue
    ) -> tuple[
        Float[Array, "values channels"],
        Float[Array, "values channels"],
        Float[Array, "free values channels"],
        Float[Array, "free values channels"],
    ]:
        """Return mean and variance of lamps, each at one brightness, and their derivatives."""
        mean, variance = (values[:, 0] for values in self.lamps.moments(signals, factors[:, None]))
        by_mean, by_variance = self.lamps.by_electrons(signals, factors)
        by_u = self.lit_by_u[:, signals] * factors[:, None] + self.dark_by_u[:, None]
        mean_by_u, variance_by_u = (
            (by_mean * by_u) @ self.lamps.weights,
            (by_variance * by_u) @ self.lamps.spread_weights,
        )
        return mean, variance, mean_by_u, variance_by_u
