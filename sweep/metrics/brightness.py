"""Distance and errors of two lamps of unknown brightness: from the reading of one to the brightness curve of the other.

R(a) is the reading of a lamp of brightness a, relative to that of the scene. The chromatic distance of two lamps is the
smaller of min |R1(1) - R2(a)| and min |R1(a) - R2(1)|, in DN or in units of the noise of both readings (d'). Curves are
taken at nodes, and refined where they come near.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

from ..base.types import Array, Bool, BoolArray, DesignCurves, Float, IndexArray, Int
from ..camera.brightness import LampReadings
from ..camera.setup import Setup
from .discrimination import balance_of

LEAST_DN2 = 1e-9
"""Least variance in units of which a distance is taken, DN^2."""
_MARGINS = (1.3, 1.05, 1.01)
"""Pairs are refined, again and again, that come as near as this times the nearest squared distance of all."""
_FOLLOWED = 1.1
"""Pairs that come as near as this times the nearest squared distance are looked at in other cases, too."""
_SCALE_DIGITS = 12
_NEWTON_STEPS, _NEWTON_STEP, _CONVERGED = 12, 1e-5, 1e-10
_FINER = 12
"""Finer segments in the place of the nearest one and its neighbors."""
DARK_TO_FULL = (0.0, np.inf)
"""Brightness from no light to where all pixels are full."""


@dataclass(frozen=True)
class Nearest:
    """Nearest points of curves: signal that is read, signal of the curve, its brightness, and the squared distance."""

    reading: Int[IndexArray, " nearest"]
    curve: Int[IndexArray, " nearest"]
    factor: Float[Array, " nearest"]
    squared: Float[Array, " nearest"]
    bracket: Float[Array, "nearest 2"]
    """Brightnesses between which the nearest point lies."""

    def subset(self, which: Int[IndexArray, " values"] | Bool[BoolArray, " values"]) -> Nearest:
        """Return some of the points."""
        return Nearest(
            self.reading[which], self.curve[which], self.factor[which], self.squared[which], self.bracket[which]
        )

    @staticmethod
    def joined(parts: Sequence[Nearest]) -> Nearest:
        """Return the points of all parts."""
        names = [field.name for field in fields(Nearest)]
        return Nearest(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


class BrightnessCurves:
    """Readings and brightness curves of all lamps in one case, or in several that differ in brightness alone.

    `scales`: brightness of the lamps that are read in each of these cases, as of the moments of a pulse; `cases`: their
    numbers; `least_dn2`: variance in units of which distances are taken at least.
    """

    def __init__(
        self,
        lamps: LampReadings,
        brightness: tuple[float, float] | None = None,
        scales: Sequence[float] = (1.0,),
        steps: int = 1,
        least_dn2: float = LEAST_DN2,
        cases: Sequence[int] = (0,),
    ) -> None:
        self.lamps = lamps
        self.cases = np.array(cases)
        self._least_dn2 = least_dn2
        self._scales, self._scale_of_case = np.unique(np.round(scales, _SCALE_DIGITS), return_inverse=True)
        self._range, self._steps = DARK_TO_FULL if brightness is None else brightness, steps

    @cached_property
    def _nodes(self) -> Float[Array, "signals nodes"]:
        return self.lamps.nodes(*self._range, self._steps)

    @property
    def darkest(self) -> float:
        """Least brightness."""
        return float(self._nodes.min())

    @cached_property
    def _readings(self) -> tuple[Float[Array, "readings channels"], Float[Array, "readings channels"]]:
        """Mean and variance of each lamp at each scale."""
        every = np.arange(self.lamps.n_signals)
        moments = self.lamps.moments(every, np.broadcast_to(self._scales, (every.size, self._scales.size)))
        mean, variance = (np.ascontiguousarray(np.swapaxes(values, 0, 1)) for values in moments)
        return mean.reshape(-1, mean.shape[-1]), variance.reshape(-1, mean.shape[-1])

    @cached_property
    def _means(self) -> Float[Array, "signals factors channels"]:
        return self.lamps.means(np.arange(self.lamps.n_signals), self._nodes)

    @cached_property
    def _moments(self) -> tuple[Float[Array, "signals factors channels"], Float[Array, "signals factors channels"]]:
        return self.lamps.moments(np.arange(self.lamps.n_signals), self._nodes)

    def nearest(
        self,
        first: Int[IndexArray, " first"],
        second: Int[IndexArray, " second"],
        *,
        noise: bool,
        margin: float = np.inf,
        nearest: float = np.inf,
    ) -> Nearest:
        """Return the points of curves that are nearest to readings, of each reading of one type and curve of the other.

        Both orders of the types are taken; pairs that are farther than `margin` times the nearest squared distance, or
        times one that is known, may be at an infinite one.
        """
        reading = np.concatenate([np.repeat(first, second.size), np.repeat(second, first.size)])
        curve = np.tile([*np.tile(second, first.size), *np.tile(first, second.size)], self._scales.size)
        reading = (reading + self.lamps.n_signals * np.arange(self._scales.size)[:, None]).ravel()
        curves = self._moments if noise else (self._means, self._means)
        return self._on(curves, self._nodes, reading, curve, curve, noise=noise, margin=margin, nearest=nearest)

    def refined(self, found: Nearest, *, noise: bool) -> Nearest:
        """Refine nearest points between finer nodes; curves that are straight between nodes need none."""
        return found if self.lamps.straight and not noise else self._finer(found, noise=noise)

    def of_cases(self, points: Nearest) -> Float[Array, " cases"]:
        """Return the smallest distance among some points in each case."""
        least = np.full(self._scales.size, np.inf)
        np.minimum.at(least, points.reading // self.lamps.n_signals, points.squared)
        return np.asarray(np.sqrt(least[self._scale_of_case]), dtype=float)

    def pairs_of(self, points: Nearest, case: int) -> Nearest:
        """Return the points of one case, of lamps of the scene's brightness, in brackets relative to theirs."""
        scale = self._scale_of_case[case]
        points = points.subset(points.reading // self.lamps.n_signals == scale)
        brightness = self._scales[scale] or 1.0
        return replace(points, reading=points.reading % self.lamps.n_signals, bracket=points.bracket / brightness)

    def follow(self, pairs: Sequence[Nearest], *, noise: bool) -> Float[Array, " cases"]:
        """Return the smallest distance of some pairs in each case, from where their points are known elsewhere."""
        points = []
        for scale, near in zip(self._scale_of_case, pairs, strict=True):
            reading = near.reading + self.lamps.n_signals * scale
            bracket = np.clip(near.bracket * self._scales[scale], *self._range)
            points.append(replace(near, reading=reading, bracket=bracket))
        found = self._finer(Nearest.joined(points), noise=noise)
        for margin in _MARGINS[1:]:
            most = margin * found.squared.min(initial=np.inf)
            found = self._finer(found.subset(found.squared <= most), noise=noise)
        return self.of_cases(found)

    def _finer(self, found: Nearest, *, noise: bool) -> Nearest:
        if not found.curve.size:
            return found
        (low, high), rows = found.bracket.T, np.arange(found.curve.size)
        nodes = low[:, None] + (high - low)[:, None] * np.linspace(0.0, 1.0, _FINER + 1)
        means = self.lamps.moments(found.curve, nodes) if noise else (self.lamps.means(found.curve, nodes),) * 2
        return self._on(means, nodes, found.reading, found.curve, rows, noise=noise)

    def polished(self, found: Nearest, *, noise: bool) -> Float[Array, " nearest"]:
        """Return the brightnesses of nearest points by Newton's method, from where they are known between nodes."""
        (mean, variance), factor = (values[found.reading] for values in self._readings), found.factor.copy()

        def slope(factors: Float[Array, " nearest"]) -> Float[Array, " nearest"]:
            there, spread, by_mean, by_spread = self.lamps.along(found.curve, factors)
            difference = mean - there
            if not noise:
                return np.asarray((-difference * by_mean).sum(axis=1))
            moving = by_spread * (spread > self._least_dn2)
            ours, theirs = np.maximum(variance, self._least_dn2), np.maximum(spread, self._least_dn2)
            w = balance_of(difference, ours, theirs)[:, None]
            weight = 4 * w / ((1 + w) * (ours + w * theirs))
            changes = difference**2 * moving * weight**2 * (1 + w) / 8
            return np.asarray((-difference * by_mean * weight - changes).sum(axis=1))

        (low, high), (darkest, brightest) = found.bracket.T, (self._nodes[found.curve, end] for end in (0, -1))
        low, high = np.maximum(2 * low - high, darkest), np.minimum(2 * high - low, brightest)
        for _ in range(_NEWTON_STEPS):
            step = _NEWTON_STEP * np.maximum(factor, 1e-300)
            here = slope(factor)
            low, high = np.where(here < 0, factor, low), np.where(here > 0, factor, high)
            bend = (slope(factor + step) - here) / step
            moved = factor - np.divide(here, bend, out=np.full_like(here, np.inf), where=bend > 0)
            before, factor = factor, np.where((low <= moved) & (moved <= high), moved, (low + high) / 2)
            if (np.abs(factor - before) <= _CONVERGED * before).all():
                break
        return factor

    def _on(
        self,
        curves: tuple[DesignCurves, DesignCurves],
        nodes: Float[Array, "designs modified"],
        reading: Int[IndexArray, " nearest"],
        curve: Int[IndexArray, " nearest"],
        rows: Int[IndexArray, " rows"],
        *,
        noise: bool,
        margin: float = np.inf,
        nearest: float = np.inf,
    ) -> Nearest:
        """Return the nearest points on curves between nodes; `rows`: the row of `curves` and `nodes` of each."""
        from .brightness_kernels import nearest_on_curves  # noqa: PLC0415  (compiled: kept off the start-up path)

        squared, share = np.empty(rows.size), np.zeros(rows.size)
        segment = np.zeros(rows.size, dtype=np.intp)
        least = self._least_dn2 if noise else 0.0
        nearest_on_curves(*self._readings, *curves, reading, rows, least, margin, nearest, squared, segment, share)
        low, high = nodes[rows, segment], nodes[rows, segment + 1]
        before = nodes[rows, np.maximum(segment - 1, 0)]
        after = nodes[rows, np.minimum(segment + 2, nodes.shape[1] - 1)]
        return Nearest(reading, curve, low + share * (high - low), squared, np.stack([before, after], axis=1))


def curves_of(cases: Iterable[LampReadings], setup: Setup) -> list[BrightnessCurves]:
    """Return the curves of all cases; cases that differ in the brightness of all lamps alone share theirs."""
    brightness, steps = setup.scene.brightness, setup.accuracy.brightness_steps
    groups: list[tuple[LampReadings, list[float], list[int]]] = []
    for number, lamps in enumerate(cases):
        first, scales, numbers = groups[-1] if groups else (lamps, [], [])
        scale = float(lamps.lit_e.max() / first.lit_e.max()) if first.lit_e.max() > 0 else 0.0
        if groups and brightness is None and lamps.alike(first, scale):
            scales.append(scale)
            numbers.append(number)
        else:
            groups.append((lamps, [1.0], [number]))
    return [BrightnessCurves(lamps, brightness, scales, steps, cases=numbers) for lamps, scales, numbers in groups]


@dataclass(frozen=True)
class Walk:
    """Smallest distances of two types of lamps of any brightness, in each case; infinite where it is no smallest.

    `pairs`: those that may be nearest in each case, as of `BrightnessCurves.pairs_of`; cases are moments of a place,
    place by place.
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
            found.append(of_cases.nearest(first, second, noise=noise, margin=_MARGINS[0], nearest=least))
            least = min(least, float(found[-1].squared.min(initial=np.inf)))
        coarse = [points.subset(points.squared <= _FOLLOWED * least) for points in found]
        for margin in _MARGINS if least > 0 else ():
            most = margin * min(float(points.squared.min(initial=np.inf)) for points in found)
            found = [
                of_cases.refined(points.subset(points.squared <= most), noise=noise)
                for of_cases, points in zip(curves, found, strict=True)
            ]
        n_cases = sum(of_cases.cases.size for of_cases in curves)
        distances, pairs = np.empty(n_cases), dict[int, Nearest]()
        for of_cases, points, near in zip(curves, found, coarse, strict=True):
            distances[of_cases.cases] = of_cases.of_cases(points)
            pairs |= {int(number): of_cases.pairs_of(near, at) for at, number in enumerate(of_cases.cases)}
        return cls(distances, [pairs[number] for number in range(n_cases)], n_cases // n_places)


def _distinct(parts: Sequence[Nearest]) -> Nearest:
    """Return the pairs of all parts once, in brackets that hold all of theirs."""
    every = Nearest.joined(parts)
    keys = np.stack([every.reading, every.curve], axis=1)
    _, first, which = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    low, high = every.bracket[first].T.copy()
    np.minimum.at(low, which.ravel(), every.bracket[:, 0])
    np.maximum.at(high, which.ravel(), every.bracket[:, 1])
    return replace(every.subset(first), bracket=np.stack([low, high], axis=1))
