"""Distance and errors of two lamps of unknown brightness: from the reading of one to the brightness curve of the other.

R(a) is the reading of a lamp of brightness a, relative to that of the scene. The chromatic distance of two lamps is the
smaller of min |R1(1) - R2(a)| and min |R1(a) - R2(1)|, in DN or in units of the noise of both readings (d'); the error
is that of two Gaussians at the smallest d'. Curves are taken at nodes, and refined where they come near.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..base.types import Array, Bool, BoolArray, DesignCurves, Float, IndexArray, Int
from ..camera.brightness import LampReadings
from ..camera.noise.gaussian import share_below
from ..camera.setup import Setup

LEAST_DN2 = 1e-9
"""Least variance in units of which a distance is taken, DN^2."""
_MARGINS = (1.7, 1.05, 1.01)
"""Pairs are refined, again and again, that come as near as this times the nearest squared distance of all."""
_MOST_PAIRS = 200
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


class BrightnessCurves:
    """Readings and brightness curves of all lamps in one case, or in several that differ in brightness alone.

    `scales`: brightness of the lamps that are read in each of these, as of the moments of a pulse. `least_dn2`:
    variance in units of which distances are taken at least.
    """

    def __init__(
        self,
        lamps: LampReadings,
        brightness: tuple[float, float] | None = None,
        scales: Sequence[float] | Float[Array, " scales"] = (1.0,),
        steps: int = 1,
        least_dn2: float = LEAST_DN2,
    ) -> None:
        self.lamps = lamps
        self._least_dn2 = least_dn2
        self._scales = np.array(scales, dtype=float)
        self._nodes = lamps.nodes(*(DARK_TO_FULL if brightness is None else brightness), steps)

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
        if not found.curve.size or (self.lamps.straight and not noise):
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
            if not noise:
                return np.asarray((-(mean - there) * by_mean).sum(axis=1))
            total = np.maximum((variance + spread) / 2, self._least_dn2)
            moving = by_spread * (total > self._least_dn2)
            difference = mean - there
            return np.asarray((-difference * by_mean / total - difference**2 * moving / (4 * total**2)).sum(axis=1))

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
    if brightness is not None:
        return [BrightnessCurves(lamps, brightness, steps=steps) for lamps in cases]
    groups: list[tuple[LampReadings, list[float]]] = []
    for lamps in cases:
        first, scales = groups[-1] if groups else (lamps, [])
        scale = float(lamps.lit_e.max() / first.lit_e.max()) if first.lit_e.max() > 0 else 0.0
        if groups and lamps.alike(first, scale):
            scales.append(scale)
        else:
            groups.append((lamps, [1.0]))
    return [BrightnessCurves(lamps, scales=np.unique(np.round(scales, 12)), steps=steps) for lamps, scales in groups]


def chromatic_distance(
    cases: Sequence[BrightnessCurves],
    first: Int[IndexArray, " first"],
    second: Int[IndexArray, " second"],
    *,
    noise: bool,
) -> float:
    """Return the smallest distance of two types over all cases, in units of the noise or in DN."""
    found: list[Nearest] = []
    least = np.inf
    for case in cases:
        found.append(case.nearest(first, second, noise=noise, margin=_MARGINS[0], nearest=least))
        least = min(least, float(found[-1].squared.min(initial=np.inf)))
    for margin in _MARGINS:
        most = margin * min(float(points.squared.min(initial=np.inf)) for points in found)
        near = [points.subset(np.flatnonzero(points.squared <= most)[:_MOST_PAIRS]) for points in found]
        found = [case.refined(points, noise=noise) for case, points in zip(cases, near, strict=True)]
    return float(np.sqrt(min(float(points.squared.min(initial=np.inf)) for points in found)))


def error_of(dprime: Float[Array, " *batch"] | float) -> Float[Array, " ..."]:
    """Return the error of two Gaussians at a distance in units of their noise, Q(d' / 2)."""
    return share_below(-dprime / 2)
