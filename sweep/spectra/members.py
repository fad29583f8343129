"""Members of a population of lights: shifted spectra, and the shifts of two lights that occur together.

A spectrum is linear between the nodes of the wavelength grid. A spectrum shifted by part of a step is therefore a mean
of the two that are shifted by whole steps, and every response that is linear in light is linear in the shift between
whole steps. Photons that are shifted out of the grid are lost, as behind an IR cut filter.

The shifts (x, y) of two lights that occur together fill a convex polygon: a line of temperatures, widened by the
independent shifts of each light. Cut along whole steps of x and y it falls into pieces, each of triangles, on which
the difference of two responses is linear.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from ..base.types import Array, Float, IndexArray, Int, MemberNumbers, PerValue, PerWavelength
from .lights import Lights, Pair
from .population import Population
from .spectrum import WavelengthGrid

_DIGITS, _TINY = 9, 1e-9
"""Shifts are known to this share of a step: rounding."""
_Point = tuple[float, float]


@dataclass(frozen=True)
class ShiftRegion:
    """Triangles of the shifts of two lights that occur together, in steps of the grid from the first shift.

    `cells`: whole steps below each triangle; `shares`: corners above these, 0 to 1; `along`: position along the
    region's length, 0 to 1.
    """

    cells: Int[IndexArray, "cells 2"]
    shares: Float[Array, "cells 3 2"]
    along: Float[Array, " cells"]


class Members:
    """Spectra of the lights of a population on a wavelength grid.

    `lights` holds each width of each signal, shifted by every whole step: `n_steps` spectra each.
    """

    def __init__(self, lights: Lights, grid: WavelengthGrid) -> None:
        assert lights.population is not None
        self._lights, self._step_nm, self.population = lights, grid.step_nm, lights.population
        spans = spans_nm(lights, lights.population)
        self._first = int(np.floor(min(low for low, _ in spans) / grid.step_nm + _TINY))
        last = int(np.ceil(max(high for _, high in spans) / grid.step_nm - _TINY))
        self.n_steps = max(last - self._first, 1) + 1
        widths = self.population.width
        photons = [stretched(grid, spectrum, factor) for spectrum in lights.photons for factor in widths]
        steps = range(self._first, self._first + self.n_steps)
        shifted = np.stack([moved(spectrum, step) for spectrum in photons for step in steps])
        n_spectra = len(widths) * self.n_steps
        names = tuple(name for name in lights.names for _ in range(n_spectra))
        types = tuple(kind for kind in lights.types for _ in range(n_spectra))
        self.lights = replace(lights, names=names, types=types, photons=shifted, population=None)
        self._regions: dict[tuple[float, ...], ShiftRegion] = {}

    @cached_property
    def rows(self) -> dict[str, MemberNumbers]:
        """First spectrum of each signal and width in `lights`, by signal type."""
        starts = {name: rows[:: self.n_steps] for name, rows in self.lights.members.items()}
        return {name: np.asarray(rows, dtype=np.intp) for name, rows in starts.items()}

    def signal(self, row: int) -> int:
        """Return the signal of a spectrum."""
        return row // (len(self.population.width) * self.n_steps)

    def steps_of(self, shift_nm: PerValue) -> PerValue:
        """Return the steps of a shift after the first one.

        Returns steps, 0 or more.
        """
        return np.asarray(np.clip(shift_nm / self._step_nm - self._first, 0.0, self.n_steps - 1), dtype=float)

    def shift_nm(self, cell: int, share: float) -> float:
        """Return a shift."""
        return (self._first + cell + share) * self._step_nm

    def drift_and_independent(self, signal: int) -> tuple[float, tuple[float, float]]:
        """Return drift and independent shifts of a signal, nm.

        Drift is in nm/K, the range of shifts by binning and ageing in nm.
        """
        return _drift_and_independent(self._lights, self.population, signal)

    def regions(self, pair: Pair) -> tuple[list[ShiftRegion], Int[IndexArray, "first second"]]:
        """Return the distinct regions of two types, and the region of each two signals and widths."""
        first, second = (self.rows[name] for name in pair)
        known: dict[int, int] = {}
        regions: list[ShiftRegion] = []
        indices = np.empty((first.size, second.size), dtype=np.intp)
        for row_index, signals in enumerate(first):
            for other, column in enumerate(second):
                region = self.region(self.signal(int(signals)), self.signal(int(column)))
                if id(region) not in known:
                    known[id(region)] = len(regions)
                    regions.append(region)
                indices[row_index, other] = known[id(region)]
        return regions, indices

    def region(self, first: int, second: int) -> ShiftRegion:
        """Return the shifts of two signals that occur together."""
        (a, own_a), (b, own_b) = self.drift_and_independent(first), self.drift_and_independent(second)
        key = (a, *own_a, b, *own_b)
        if key not in self._regions:
            corners = _corners(self.population, (a, b), (own_a, own_b))
            self._regions[key] = _region(
                [(x / self._step_nm - self._first, y / self._step_nm - self._first) for x, y in corners]
            )
        return self._regions[key]


def spans_nm(lights: Lights, population: Population) -> list[tuple[float, float]]:
    """Return the range of shifts of each signal."""
    spans = []
    for signal in range(len(lights.names)):
        drift, (low, high) = _drift_and_independent(lights, population, signal)
        ends = [drift * warmer for warmer in population.warmer_k]
        spans.append((min(ends) + low, max(ends) + high))
    return spans


def _drift_and_independent(lights: Lights, population: Population, signal: int) -> tuple[float, tuple[float, float]]:
    """Return drift, nm/K, and range of independent shifts of a signal."""
    kind, name = lights.types[signal], lights.names[signal]
    drift = population.drift(kind, name)
    assert drift is not None
    return drift, population.independent_nm(kind, name)


def moved(photons: PerWavelength, steps: int) -> PerWavelength:
    """Return a spectrum shifted by whole steps toward the red."""
    shifted = np.zeros_like(photons)
    size = photons.size
    if abs(steps) < size:
        shifted[max(steps, 0) : size + min(steps, 0)] = photons[max(-steps, 0) : size - max(steps, 0)]
    return shifted


def stretched(grid: WavelengthGrid, photons: PerWavelength, factor: float) -> PerWavelength:
    """Return a spectrum stretched about its mean wavelength, with equal photons."""
    if factor == 1:
        return photons
    wave = grid.nodes_nm
    middle = float((wave * photons).sum() / photons.sum())
    wider = np.interp(middle + (wave - middle) / factor, wave, photons, left=0.0, right=0.0)
    return np.asarray(wider * (photons.sum() / wider.sum()), dtype=float)


def _corners(
    population: Population, drifts: tuple[float, float], independent: tuple[tuple[float, float], tuple[float, float]]
) -> list[_Point]:
    """Return points whose hull is the region of two lights, nm."""
    (a, b), (x, y) = drifts, independent
    warmings = [(warmer, warmer) for warmer in population.warmer_k]
    if population.temperatures == "independent":
        warmings = [(warmer_a, warmer_b) for warmer_a in population.warmer_k for warmer_b in population.warmer_k]
    return [(a * warmer_a + u, b * warmer_b + v) for warmer_a, warmer_b in warmings for u in x for v in y]


def _hull(points: list[_Point]) -> list[_Point]:
    """Return the corners of the convex hull (Andrew, 1979); two points of a line, one of a single point."""
    points = sorted({(round(x, _DIGITS), round(y, _DIGITS)) for x, y in points})
    if len(points) < 3:
        return points

    def half(ordered: list[_Point]) -> list[_Point]:
        chain: list[_Point] = []
        for point in ordered:
            while len(chain) > 1 and _cross(chain[-2], chain[-1], point) <= _TINY:
                chain.pop()
            chain.append(point)
        return chain[:-1]

    return half(points) + half(points[::-1])


def _cross(o: _Point, p: _Point, q: _Point) -> float:
    return (p[0] - o[0]) * (q[1] - o[1]) - (p[1] - o[1]) * (q[0] - o[0])


def _clipped(polygon: list[_Point], axis: int, bound: float, sign: float) -> list[_Point]:
    """Return the part of a polygon with sign x (coordinate - bound) >= 0 (Sutherland and Hodgman)."""
    clipped: list[_Point] = []
    for here, there in zip(polygon, polygon[1:] + polygon[:1], strict=True):
        u, v = sign * (here[axis] - bound), sign * (there[axis] - bound)
        if u >= 0:
            clipped.append(here)
        if (u < 0 < v) or (v < 0 < u):
            share = u / (u - v)
            cut = [p + (q - p) * share for p, q in zip(here, there, strict=True)]
            cut[axis] = bound
            clipped.append((cut[0], cut[1]))
    return list(dict.fromkeys(clipped))


def _size(polygon: list[_Point]) -> tuple[float, float]:
    """Return the area, and the longest way between two corners."""
    area = sum(_cross(polygon[0], p, q) for p, q in pairwise(polygon)) / 2
    longest = max((float(np.hypot(p[0] - q[0], p[1] - q[1])) for p in polygon for q in polygon), default=0.0)
    return abs(area), longest


def _region(points: list[_Point]) -> ShiftRegion:
    hull = _hull(points)
    area, length = _size(hull)
    cells, shares = [], []
    low, high = np.floor(np.min(hull, axis=0)), np.ceil(np.max(hull, axis=0))
    for k in range(int(low[0]), max(int(high[0]), int(low[0]) + 1)):
        column = _clipped(_clipped(hull, 0, k, 1.0), 0, k + 1, -1.0)
        for m in range(int(low[1]), max(int(high[1]), int(low[1]) + 1)) if column else ():
            piece = _clipped(_clipped(column, 1, m, 1.0), 1, m + 1, -1.0)
            own_area, own_length = _size(piece)
            # What a piece has in common with its neighbor alone is part of the neighbor.
            if not piece or (area > _TINY and own_area < _TINY**2) or (length > _TINY and own_length < _TINY):
                continue
            last = len(piece) - 1
            for at in range(1, max(last, 2)):
                corners = [piece[0], piece[min(at, last)], piece[min(at + 1, last)]]
                cells.append((k, m))
                shares.append([(x - k, y - m) for x, y in corners])
    middles = np.array(cells) + np.mean(shares, axis=1)
    return ShiftRegion(np.array(cells, dtype=np.intp), np.array(shares), _along(middles))


def _along(points: Float[Array, "points 2"]) -> Float[Array, " points"]:
    """Return where points lie along the direction in which they are spread most, 0 to 1."""
    centered = points - points.mean(axis=0)
    at = centered @ np.linalg.svd(centered, full_matrices=False)[2][0]
    return np.asarray((at - at.min()) / max(float(np.ptp(at)), _TINY), dtype=float)
