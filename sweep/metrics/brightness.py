"""Distance and errors of two lamps of unknown brightness: from the reading of one to the brightness curve of the other.

R(a) is the reading of a lamp of brightness a, relative to that of the scene. The chromatic distance of two lamps is the
smaller of min |R1(1) - R2(a)| and min |R1(a) - R2(1)|, in DN or in units of the noise of both readings (d'); the error
is that of two Gaussians at the smallest d'. Curves are taken at nodes, and refined where they come near.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..base.types import BoolArray, FloatArray, IndexArray
from ..camera.brightness import LampReadings
from ..camera.noise.gaussian import share_below

LEAST_DN2 = 1e-9
"""Least variance in units of which a distance is taken, DN^2."""
_MARGINS = (1.7, 1.05)
"""Pairs are refined, once and again, that come as near as this times the nearest squared distance of all."""
_MOST_PAIRS = 200
_FINER = 12
"""Finer segments in the place of the nearest one and its neighbors."""
DARK_TO_FULL = (0.0, np.inf)
"""Brightness from no light to where all pixels are full."""


@dataclass(frozen=True)
class Nearest:
    """Nearest points of curves: signal that is read, signal of the curve, its brightness, and the squared distance."""

    reading: IndexArray
    curve: IndexArray
    factor: FloatArray
    squared: FloatArray
    bracket: FloatArray
    """Brightnesses between which the nearest point lies, [n, 2]."""

    def subset(self, which: IndexArray | BoolArray) -> Nearest:
        """Return some of the points."""
        return Nearest(
            self.reading[which], self.curve[which], self.factor[which], self.squared[which], self.bracket[which]
        )


class BrightnessCurves:
    """Readings and brightness curves of all lamps in one case."""

    def __init__(self, lamps: LampReadings, brightness: tuple[float, float] = DARK_TO_FULL) -> None:
        self.lamps = lamps
        self._nodes = lamps.nodes(*brightness)

    @cached_property
    def _readings(self) -> tuple[FloatArray, FloatArray]:
        """Mean and variance of each lamp at the brightness of the scene, [n_signals, n_channels]."""
        every = np.arange(self.lamps.n_signals)
        mean, variance = self.lamps.moments(every, np.ones((every.size, 1)))
        return np.ascontiguousarray(mean[:, 0]), np.ascontiguousarray(variance[:, 0])

    @cached_property
    def _means(self) -> FloatArray:
        return self.lamps.means(np.arange(self.lamps.n_signals), self._nodes)

    @cached_property
    def _variances(self) -> FloatArray:
        return self.lamps.moments(np.arange(self.lamps.n_signals), self._nodes)[1]

    def nearest(
        self, first: IndexArray, second: IndexArray, *, noise: bool, margin: float = np.inf, nearest: float = np.inf
    ) -> Nearest:
        """Return the points of curves that are nearest to readings, of each reading of one type and curve of the other.

        Both orders of the types are taken; pairs that are farther than `margin` times the nearest squared distance, or
        times one that is known, may be at an infinite one.
        """
        reading = np.concatenate([np.repeat(first, second.size), np.repeat(second, first.size)])
        curve = np.concatenate([np.tile(second, first.size), np.tile(first, second.size)])
        curves = self._means, self._variances if noise else self._means
        return self._on(curves, self._nodes, reading, curve, curve, noise=noise, margin=margin, nearest=nearest)

    def refined(self, found: Nearest, *, noise: bool) -> Nearest:
        """Refine nearest points between finer nodes; curves that are straight between nodes need none."""
        if self.lamps.straight and not noise:
            return found
        (low, high), rows = found.bracket.T, np.arange(found.curve.size)
        nodes = low[:, None] + (high - low)[:, None] * np.linspace(0.0, 1.0, _FINER + 1)
        means = self.lamps.moments(found.curve, nodes) if noise else (self.lamps.means(found.curve, nodes),) * 2
        return self._on(means, nodes, found.reading, found.curve, rows, noise=noise)

    def _on(
        self,
        curves: tuple[FloatArray, FloatArray],
        nodes: FloatArray,
        reading: IndexArray,
        curve: IndexArray,
        rows: IndexArray,
        *,
        noise: bool,
        margin: float = np.inf,
        nearest: float = np.inf,
    ) -> Nearest:
        """Return the nearest points on curves between nodes; `rows`: the row of `curves` and `nodes` of each."""
        from .compiled_brightness import nearest_on_curves  # noqa: PLC0415  (compiled: kept off the start-up path)

        squared, share = np.empty(rows.size), np.zeros(rows.size)
        segment = np.zeros(rows.size, dtype=np.intp)
        least = LEAST_DN2 if noise else 0.0
        nearest_on_curves(*self._readings, *curves, reading, rows, least, margin, nearest, squared, segment, share)
        low, high = nodes[rows, segment], nodes[rows, segment + 1]
        before = nodes[rows, np.maximum(segment - 1, 0)]
        after = nodes[rows, np.minimum(segment + 2, nodes.shape[1] - 1)]
        return Nearest(reading, curve, low + share * (high - low), squared, np.stack([before, after], axis=1))


def chromatic_distance(
    cases: Sequence[BrightnessCurves], first: IndexArray, second: IndexArray, *, noise: bool
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


def error_of(dprime: FloatArray) -> FloatArray:
    """Return the error of two Gaussians at a distance in units of their noise, Q(d' / 2)."""
    return share_below(-dprime / 2)
