"""Distance and errors of two lamps of unknown brightness: from the reading of one to the brightness curve of the other.

R(a) is the reading of a lamp of brightness a, relative to that of the scene. The chromatic distance of two lamps is the
smaller of min |R1(1) - R2(a)| and min |R1(a) - R2(1)|, in DN or in units of the noise of both readings (d'). Curves are
walked along from dark to where all pixels are full; see `walk_kernels`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from itertools import chain

import numpy as np

from ..base.types import Array, Bool, BoolArray, Float, IndexArray, Int
from ..camera.brightness import LampReadings
from ..camera.setup import Setup
from .discrimination import balance_of, dprime

LEAST_DN2 = 1e-9
"""Least variance in units of which a distance is taken, DN^2."""
_FAR = 1.3
"""Cases whose smallest squared distance is up to this times that of another one are told as they are."""
_FOLLOWED = 1.1
"""Pairs that come as near as this times the nearest squared distance are looked at in other cases, too."""
_POLISHED = 1.01
"""Those up to this times the smallest one are polished."""
EXACT = 1e-4
"""A walk proves the smallest distance to this share and this many DN, or units of the noise: below, there is none."""
_AROUND, _FINER, _ROUNDS = 1.12, 13, 3
"""Ratio of brightnesses beside a known one; numbers between them that are read, again and again."""
_SCALE_DIGITS, _BESIDE = 12, 1e-5
_ROOTS = 12
"""Segments of a curve before any is halved."""
_LEAST_E, _MOST_RATIO, _SEEN = 0.5, 1e9, 1e-4
"""Electrons of the brightest pixel at the dimmest end but dark; a pixel that so much more light would not fill, or
whose weight in a channel is less, relative to the largest, is not waited for."""
_NO_LIGHT_E = 1e-280
"""Electrons of a lamp that sends none, so that its brightnesses are numbers."""
DARK_TO_FULL = (0.0, np.inf)
"""Brightness from no light to where all pixels are full."""


@dataclass(frozen=True)
class Nearest:
    """Nearest points of curves: signal that is read, signal of the curve, its brightness, and the squared distance."""

    reading: Int[IndexArray, " nearest"]
    curve: Int[IndexArray, " nearest"]
    factor: Float[Array, " nearest"]
    squared: Float[Array, " nearest"]

    def subset(self, which: Int[IndexArray, " values"] | Bool[BoolArray, " values"]) -> Nearest:
        """Return some of the points."""
        return Nearest(self.reading[which], self.curve[which], self.factor[which], self.squared[which])

    @staticmethod
    def joined(parts: Sequence[Nearest]) -> Nearest:
        """Return the points of all parts."""
        names = [field.name for field in fields(Nearest)]
        return Nearest(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


class BrightnessCurves:
    """Readings and brightness curves of all lamps in one case, or in several that differ in brightness alone.

    `least_dn2`: variance in units of which distances are taken at least; `unproven`: segments of curves that could not
    be divided any further.
    """

    def __init__(
        self, lamps: LampReadings, brightness: tuple[float, float] | None = None, least_dn2: float = LEAST_DN2
    ) -> None:
        self.lamps = lamps
        self.cases = np.array(lamps.cases)
        self._least_dn2, self.unproven = least_dn2, 0
        self._scales, self._scale_of_case = np.ones(1), np.zeros(1, dtype=np.intp)
        if len(lamps.scales) > 1:
            self._scales, self._scale_of_case = np.unique(np.round(lamps.scales, _SCALE_DIGITS), return_inverse=True)
        self._range = DARK_TO_FULL if brightness is None else brightness

    @property
    def darkest(self) -> float:
        """Least brightness."""
        return self._range[0]

    @cached_property
    def _starts(self) -> Float[Array, "signals starts"]:
        """Brightnesses of each lamp between which curves are walked along."""
        lit, dark, tables, *_, ends, _, _, _, weights, _, _ = self.lamps.in_kernels
        seen = weights.max(axis=1) > _SEEN * weights.max()
        brightest = np.maximum(lit.max(axis=1, keepdims=True), _NO_LIGHT_E)
        most = np.maximum(ends[tables] - dark, 0.0) / np.maximum(lit, brightest / _MOST_RATIO)
        last = np.maximum(most[:, seen].max(axis=1, keepdims=True), 1e-300)
        first = np.minimum(_LEAST_E / brightest, last / 2)
        steps = first * (last / first) ** (np.arange(_ROOTS) / (_ROOTS - 1))
        starts = np.concatenate([np.zeros_like(last), steps], axis=1)
        return np.ascontiguousarray(np.clip(starts, *self._range))

    @cached_property
    def _roots(self) -> Float[Array, "3 rows channels"]:
        """Mean, variance and largest variance up to there of each lamp at these brightnesses, lamp by lamp."""
        from ..camera.noise.law_kernels import largest_variances, read_lamps  # noqa: PLC0415  (compiled)

        roots = np.empty((3, self._starts.size, self.lamps.weights.shape[1]))
        lamps, every = self.lamps.in_kernels, np.arange(self.lamps.n_signals)
        read_lamps(lamps, every, self._starts, roots[0], roots[1])
        largest_variances(lamps, self._starts, roots[2].reshape(*self._starts.shape, -1))
        return roots

    @cached_property
    def _readings(self) -> tuple[Float[Array, "readings channels"], Float[Array, "readings channels"]]:
        """Mean and variance of each lamp at each scale."""
        every = np.arange(self.lamps.n_signals)
        moments = self.lamps.moments(every, np.broadcast_to(self._scales, (every.size, self._scales.size)))
        mean, variance = (np.ascontiguousarray(np.swapaxes(values, 0, 1)) for values in moments)
        return mean.reshape(-1, mean.shape[-1]), variance.reshape(-1, mean.shape[-1])

    def nearest(
        self,
        first: Int[IndexArray, " first"],
        second: Int[IndexArray, " second"],
        *,
        noise: bool,
        margin: float = 1.0,
        polished: float = _POLISHED,
        known: float = np.inf,
    ) -> Nearest:
        """Return the points of curves that are nearest to readings, of each reading of one type and curve of the other.

        Both orders of the types are taken. Squared distances above `margin` times the smallest one, or above `known`,
        may be said to be larger.
        """
        from .walk_kernels import nearest  # noqa: PLC0415  (compiled: kept off the start-up path)

        reading = np.concatenate([np.tile(first, second.size), np.tile(second, first.size)])
        curve = np.concatenate([np.repeat(second, first.size), np.repeat(first, second.size)])
        n_scales = self._scales.size
        reading = (reading[:, None] + self.lamps.n_signals * np.arange(n_scales)).ravel()
        curve = np.repeat(curve, n_scales)
        squared, factor = np.empty((2, curve.size))
        lamps, limits = self.lamps.in_kernels, (self._least_dn2 if noise else 0.0, margin, polished, known, EXACT)
        walked = self._readings, reading, curve, self._starts, self._roots
        self.unproven += nearest(lamps, *walked, *limits, (squared, factor))
        if self.lamps.proportional:
            return Nearest(reading, curve, factor, squared)
        near = squared <= max(margin, _FOLLOWED) * squared.min()  # curves between values are drawn: there read again
        points = self._followed(Nearest(reading[near], curve[near], factor[near], squared[near]), noise=noise)
        squared[near], factor[near] = points.squared, points.factor
        return Nearest(reading, curve, factor, squared)

    def settled(self, near: Nearest, *, noise: bool) -> Float[Array, " nearest"]:
        """Return the brightnesses to more digits than distances tell, by a step of the secant method.

        Brightnesses that would move farther than the step are at an end, and stay.
        """
        mean, variance = (values[near.reading] for values in self._readings)

        def slope(factors: Float[Array, " nearest"]) -> Float[Array, " nearest"]:
            there, spread, by_mean, by_spread = self.lamps.along(near.curve, factors)
            difference, weight, w = mean - there, np.ones(mean.shape), np.ones((len(mean), 1))
            if noise:
                ours, theirs = np.maximum(variance, self._least_dn2), np.maximum(spread, self._least_dn2)
                w = balance_of(difference, ours, theirs)[:, None]
                weight = 4 * w / ((1 + w) * (ours + w * theirs))
            spreads = difference**2 * by_spread * (spread > self._least_dn2) * weight**2 * (1 + w) / 4 * noise
            return np.asarray((-2 * difference * by_mean * weight - spreads).sum(axis=1))

        factor = near.factor
        here, beside = slope(factor), slope(factor * (1 + _BESIDE))
        turns = beside - here
        step = np.divide(here, turns, out=np.full_like(here, np.inf), where=turns > 0) * _BESIDE
        return np.asarray(factor * (1 - np.where(np.abs(step) < _BESIDE, step, 0.0)))

    def of_cases(self, points: Nearest) -> Float[Array, " cases"]:
        """Return the smallest distance among some points in each case; 0 where no larger one is proven."""
        least = np.full(self._scales.size, np.inf)
        np.minimum.at(least, points.reading // self.lamps.n_signals, points.squared)
        least[least <= EXACT**2] = 0.0
        return np.asarray(np.sqrt(least[self._scale_of_case]), dtype=float)

    def pairs_of(self, points: Nearest, case: int) -> Nearest:
        """Return the points of one case, of lamps of the scene's brightness, relative to theirs."""
        scale = self._scale_of_case[case]
        points = points.subset(points.reading // self.lamps.n_signals == scale)
        brightness = self._scales[scale] or 1.0
        return replace(points, reading=points.reading % self.lamps.n_signals, factor=points.factor / brightness)

    def follow(self, pairs: Sequence[Nearest], *, noise: bool) -> Float[Array, " cases"]:
        """Return the smallest distance of some pairs in each case, from where their points are known elsewhere."""
        points = []
        for scale, near in zip(self._scale_of_case, pairs, strict=True):
            reading = near.reading + self.lamps.n_signals * scale
            points.append(replace(near, reading=reading, factor=near.factor * self._scales[scale]))
        return self.of_cases(self._followed(Nearest.joined(points), noise=noise))

    def _followed(self, found: Nearest, *, noise: bool) -> Nearest:
        """Return points from where brightnesses of a pair are known to where it is nearest."""
        least = self._least_dn2 if noise else 0.0
        if self.lamps.proportional:
            from .walk_kernels import follow  # noqa: PLC0415  (compiled: kept off the start-up path)

            squared, factor = np.empty(found.curve.size), found.factor.copy()
            pairs_of = self.lamps.in_kernels, self._scales, found.reading, found.curve
            follow(*pairs_of, *self._range, least, _POLISHED, squared, factor)
            return replace(found, squared=squared, factor=factor)
        scale, signal = np.divmod(found.reading, self.lamps.n_signals)
        ours, rows = self.lamps.moments(signal, self._scales[scale][:, None]), np.arange(signal.size)
        low, high = (np.clip(found.factor * times, *self._range) for times in (1 / _AROUND, _AROUND))
        for _ in range(_ROUNDS):
            factors = np.linspace(low, high, _FINER, axis=1)
            theirs = self.lamps.moments(found.curve, factors)
            spreads = (np.maximum(variance, least) for variance in (ours[1], theirs[1]))
            apart = ours[0] - theirs[0]
            squared = dprime(apart, *spreads) ** 2 if noise else (apart**2).sum(axis=-1)
            at = squared.argmin(axis=1)
            found = replace(found, squared=squared[rows, at], factor=factors[rows, at])
            low, high = factors[rows, np.maximum(at - 1, 0)], factors[rows, np.minimum(at + 1, _FINER - 1)]
        return found


def curves_of(lamps: Iterable[LampReadings], setup: Setup) -> list[BrightnessCurves]:
    """Return the curves of all lamps; within limits of the brightness each case has its own."""
    brightness = setup.scene.brightness
    if brightness is not None:
        lamps = chain.from_iterable(of.of_cases() for of in lamps)
    return [BrightnessCurves(of, brightness) for of in lamps]


@dataclass(frozen=True)
class Walk:
    """Smallest distances of two types of lamps of any brightness, in each case.

    Those that are not the smallest of all may be told larger. `pairs`: those that may be nearest in each case, as of
    `BrightnessCurves.pairs_of`; cases are moments of a place, place by place.
    """

    distances: Float[Array, " cases"]
    pairs: Sequence[Nearest]
    n_moments: int

    @cached_property
    def at_moments(self) -> list[Nearest]:
        """Pairs that may be nearest at each moment of any place."""
        return [_distinct(self.pairs[moment :: self.n_moments]) for moment in range(self.n_moments)]

    @cached_property
    def at_any(self) -> Nearest:
        """Pairs that may be nearest at any moment of any place."""
        return _distinct(self.pairs)

    @classmethod
    def of(
        cls,
        curves: Sequence[BrightnessCurves],
        n_places: int,
        first: Int[IndexArray, " first"],
        second: Int[IndexArray, " second"],
        *,
        noise: bool,
    ) -> Walk:
        """Walk along the brightness curves of all cases; distances are in DN, or in units of the noise."""
        found: list[Nearest] = []
        least = np.inf
        for of_cases in curves:
            found.append(of_cases.nearest(first, second, noise=noise, margin=_FOLLOWED, known=_FAR * least))
            least = min(least, float(found[-1].squared.min(initial=np.inf)))
        n_cases = sum(of_cases.cases.size for of_cases in curves)
        distances, pairs = np.empty(n_cases), dict[int, Nearest]()
        for of_cases, points in zip(curves, found, strict=True):
            distances[of_cases.cases] = of_cases.of_cases(points)
            near = points.subset(points.squared <= _FOLLOWED * least)
            pairs |= {int(number): of_cases.pairs_of(near, at) for at, number in enumerate(of_cases.cases)}
        return cls(distances, [pairs[number] for number in range(n_cases)], n_cases // n_places)


def _distinct(parts: Sequence[Nearest]) -> Nearest:
    """Return the pairs of all parts once, where they are nearest."""
    every = Nearest.joined(parts)
    every = every.subset(np.argsort(every.squared, kind="stable"))
    _, first = np.unique(np.stack([every.reading, every.curve], axis=1), axis=0, return_index=True)
    return every.subset(np.sort(first))
