"""Distance and errors of two lamps of unknown brightness: from the reading of one to the brightness curve of the other.

R(a) is the reading of a lamp of brightness a, relative to that of the scene. The chromatic distance of two lamps is the
smaller of min |R1(1) - R2(a)| and min |R1(a) - R2(1)|, in DN or in units of the noise of both readings (d'); the error
is that of two Gaussians at the smallest d'. Curves are taken at nodes, and refined where they come near.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..base.types import BoolArray, FloatArray, IndexArray
from ..camera.brightness import LampReadings
from ..camera.noise.gaussian import share_below

LEAST_DN2 = 1e-9
"""Least variance in units of which a distance is taken, DN^2."""
_MARGIN = 2.25
"""Pairs are refined that come as near as this times the nearest squared distance of all."""
_MOST_PAIRS = 48
_ROUNDS, _FINER = 3, 8
"""Rounds of refinement, and the nodes in each segment around the nearest point."""
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
        parts = self.reading, self.curve, self.factor, self.squared, self.bracket
        return Nearest(*(part[which] for part in parts))


class BrightnessCurves:
    """Readings and brightness curves of all lamps in one case."""

    def __init__(self, lamps: LampReadings, brightness: tuple[float, float] = DARK_TO_FULL) -> None:
        self.lamps = lamps
        every = np.arange(lamps.n_signals)
        self._nodes = lamps.nodes(*brightness)
        self._curves = lamps.moments(every, self._nodes)
        mean, variance = lamps.moments(every, np.ones((every.size, 1)))
        self.mean, self.variance = mean[:, 0], variance[:, 0]

    def nearest(
        self, first: IndexArray, second: IndexArray, *, noise: bool, margin: float = np.inf, within: float = np.inf
    ) -> Nearest:
        """Return the points of curves that are nearest to readings, for each reading of one type and curve of the other.

        Both orders of the types are taken. With a `margin`, those alone that are within it of the nearest one, and of
        a squared distance `within`.
        """
        reading = np.concatenate([np.repeat(first, second.size), np.repeat(second, first.size)])
        curve = np.concatenate([np.tile(second, first.size), np.tile(first, second.size)])
        found = self._on(self._curves, self._nodes, reading, curve, curve, noise=noise, margin=margin)
        if np.isfinite(margin):
            most = margin * min(float(found.squared.min()), within)
            order = np.argsort(found.squared, kind="stable")[:_MOST_PAIRS]
            found = found.subset(order[found.squared[order] <= most])
        return found

    def refined(self, found: Nearest, *, noise: bool, rounds: int = _ROUNDS) -> Nearest:
        """Refine nearest points between finer nodes; curves that are straight between nodes need none."""
        for _ in range(0 if self.lamps.straight and not noise else rounds):
            low, high = found.bracket.T
            nodes = low[:, None] + (high - low)[:, None] * np.linspace(0.0, 1.0, 3 * _FINER + 1)
            curves, rows = self.lamps.moments(found.curve, nodes), np.arange(found.curve.size)
            found = self._on(curves, nodes, found.reading, found.curve, rows, noise=noise, margin=np.inf)
        return found

    def _on(
        self,
        curves: tuple[FloatArray, FloatArray],
        nodes: FloatArray,
        reading: IndexArray,
        curve: IndexArray,
        rows: IndexArray,
        *,
        noise: bool,
        margin: float,
    ) -> Nearest:
        """Return the nearest points on curves between nodes; `rows`: the row of `curves` and `nodes` of each."""
        from .compiled_brightness import nearest_on_curves  # noqa: PLC0415  (compiled: kept off the start-up path)

        squared, share = np.empty(rows.size), np.zeros(rows.size)
        segment = np.zeros(rows.size, dtype=np.intp)
        least = LEAST_DN2 if noise else 0.0
        points = np.ascontiguousarray(self.mean), np.ascontiguousarray(self.variance)
        nearest_on_curves(*points, *curves, reading, rows, least, margin, squared, segment, share)
        low, high = nodes[rows, segment], nodes[rows, segment + 1]
        before = nodes[rows, np.maximum(segment - 1, 0)]
        after = nodes[rows, np.minimum(segment + 2, nodes.shape[1] - 1)]
        return Nearest(reading, curve, low + share * (high - low), squared, np.stack([before, after], axis=1))


def chromatic_distance(
    cases: Sequence[BrightnessCurves], first: IndexArray, second: IndexArray, *, noise: bool
) -> float:
    """Return the smallest distance of two types over all cases, in units of the noise or in DN."""
    found, smallest = [], np.inf
    for case in cases:
        found.append(case.nearest(first, second, noise=noise, margin=_MARGIN, within=smallest))
        smallest = min(smallest, float(found[-1].squared.min(initial=np.inf)))
    for case, points in zip(cases, found, strict=True):
        near = case.refined(points.subset(points.squared <= _MARGIN * smallest), noise=noise)
        smallest = min(smallest, float(near.squared.min(initial=np.inf)))
    return float(np.sqrt(smallest))


def error_of(dprime: FloatArray) -> FloatArray:
    """Return the error of two Gaussians at a distance in units of their noise, Q(d' / 2)."""
    return share_below(-dprime / 2)
