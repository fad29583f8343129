"""Under which angles the rays of a lens's cone meet a filter, and how far its transmission moves at each.

The cone of f-number F has the half angle a = asin(1 / 2F) around the chief ray, which falls in at the chief ray angle
c. Its rays are weighted by their projected solid angle, cos t sin t dt dp. At the angle t from the normal it holds the
azimuths |p| <= P(t), cos P = (cos a - cos c cos t) / (sin c sin t). A ray at t meets a transmission T(l m), where
m = 1 / sqrt(1 - (sin t / n)^2) for the effective index n (Smith, Modern Optical Engineering).

A transmission that is linear between knots is averaged over all rays without any sampling of it: that takes no more
than the share of rays whose m lies between two numbers, and their mean m. Both are integrals of smooth functions
between the ends of the cone, taken by Gauss-Legendre rules that are exact to rounding.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..base.types import FloatArray

_PANELS, _ORDER = 96, 8
"""Panels of each arc of the cone at least, and points of the Gauss-Legendre rule in each."""
_RULE = np.polynomial.legendre.leggauss(_ORDER)
_FEWER = 400
"""Rays from which a rule with fewer is made."""


@dataclass(frozen=True)
class Cone:
    """A cone of rays: `half_rad` around a chief ray that is `chief_rad` off the normal; both below 90 degrees."""

    half_rad: float
    chief_rad: float


def half_angle_rad(f_number: float) -> float:
    """asin(1 / 2F); a lens faster than f/0.5 has all directions."""
    return math.asin(min(1.0, 0.5 / f_number))


def stretch(sine_squared: FloatArray, index: float) -> FloatArray:
    """m: a transmission at the wavelength l is that of l m at normal incidence."""
    return np.asarray(1 / np.sqrt(1 - sine_squared / index**2), dtype=float)


@dataclass(frozen=True)
class _Arc:
    """Part of a cone by a number from 0 to 1 that grows with the angle.

    `sine_squared`: of the angle there; `density`: of rays; `place`: the number at a squared sine. All take ndarray[n].
    """

    sine_squared: Callable[[FloatArray], FloatArray]
    density: Callable[[FloatArray], FloatArray]
    place: Callable[[FloatArray], FloatArray]


def _arcs(cone: Cone) -> list[_Arc]:
    """The part that holds all azimuths, if there is one, and the other, if there is one."""
    half, chief = cone.half_rad, cone.chief_rad
    area = math.sin(half) ** 2 * math.cos(chief)  # of the cone's projected solid angle, over pi
    found = []
    if chief < half:
        inner = math.sin(half - chief) ** 2
        found.append(_Arc(lambda u: inner * u, lambda u: np.full(u.shape, inner / area), lambda x: x / inner))
    if chief > 0:
        # t = middle - width cos(pi u): the roots at both ends of P(t) become smooth.
        middle, width = max(half, chief), min(half, chief)

        def angle(u: FloatArray) -> FloatArray:
            return np.asarray(middle - width * np.cos(math.pi * u))

        def density(u: FloatArray) -> FloatArray:
            t = angle(u)
            across = math.sin(chief) * np.sin(t)
            cosine = np.divide(
                math.cos(half) - math.cos(chief) * np.cos(t), across, out=np.zeros_like(t), where=across > 0
            )
            azimuth = np.arccos(np.clip(cosine, -1.0, 1.0)) / math.pi
            return np.asarray(2 * azimuth * np.sin(t) * np.cos(t) * width * math.pi * np.sin(math.pi * u) / area)

        def place(x: FloatArray) -> FloatArray:
            t = np.arcsin(np.sqrt(np.clip(x, 0.0, 1.0)))
            return np.asarray(np.arccos(np.clip((middle - t) / width, -1.0, 1.0)) / math.pi)

        found.append(_Arc(lambda u: np.sin(angle(u)) ** 2, density, place))
    return found


def _points(edges: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Gauss-Legendre points between neighboring edges and their weights, ndarray[n_panels, order] each."""
    node, weight = _RULE
    half = np.diff(edges)[:, None] / 2
    return edges[:-1, None] + half * (1 + node), half * weight


def rays(cone: Cone, count: int) -> tuple[FloatArray, FloatArray]:
    """Squared sines of the angles of a few rays that stand for the cone, and their weights, ndarray[count] each.

    The Gauss rule of the cone's own distribution: exact for polynomials of the squared sine of degree 2 count - 1.
    """
    panels = np.linspace(0.0, 1.0, _FEWER // _ORDER + 1)
    at, weight = _points(panels)
    arcs = _arcs(cone)
    sines = np.concatenate([arc.sine_squared(at).ravel() for arc in arcs])
    weights = np.concatenate([(arc.density(at) * weight).ravel() for arc in arcs])
    weights = np.maximum(weights, 0.0) / weights.sum()
    low, span = sines.min(), float(np.ptp(sines))
    if span <= 1e-12:
        return np.full(1, sines @ weights), np.ones(1)
    # Lanczos with full orthogonalization: the Jacobi matrix of the distribution (Golub and Welsch 1969).
    basis = [np.sqrt(weights)]
    diagonal, beside = [], []
    for step in range(count):
        moved = (sines - low) / span * basis[-1]
        diagonal.append(moved @ basis[-1])
        for _ in range(2):
            for known in basis:
                moved = moved - (moved @ known) * known
        beside.append(float(np.linalg.norm(moved)))
        basis.append(moved / beside[step])
    matrix = np.diag(diagonal) + np.diag(beside[:-1], 1) + np.diag(beside[:-1], -1)
    at_rays, vectors = np.linalg.eigh(matrix)
    return np.asarray(low + span * at_rays), np.asarray(vectors[0] ** 2)


class Stretches:
    """Where the rays of a cone see a filter: shares of them, and of their m, below any m."""

    def __init__(self, cone: Cone, index: float) -> None:
        self._index = index
        self._arcs = _arcs(cone)
        ends = np.array([[arc.sine_squared(np.array([end]))[0] for end in (0.0, 1.0)] for arc in self._arcs])
        self.least, self.most = stretch(np.array([ends.min(), ends.max()]), index)

    def below(self, m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The share of rays whose stretch is below each `m`, and the sum of theirs; `m`: ndarray[n], ascending."""
        shares, sums = np.zeros(m.size), np.zeros(m.size)
        sine_squared = np.clip(1 - 1 / np.maximum(m, 1.0) ** 2, 0.0, 1.0) * self._index**2
        for arc in self._arcs:
            own = np.clip(arc.place(sine_squared), 0.0, 1.0)
            edges = np.union1d(np.linspace(0.0, 1.0, _PANELS + 1), own)
            at, weight = _points(edges)
            rays_there = arc.density(at) * weight
            moved = rays_there * stretch(arc.sine_squared(at), self._index)
            where = np.searchsorted(edges, own)
            shares += np.append(0.0, np.cumsum(rays_there.sum(axis=1)))[where]
            sums += np.append(0.0, np.cumsum(moved.sum(axis=1)))[where]
        return shares, sums
