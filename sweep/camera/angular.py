"""Filters in the cone of rays of a lens: an interference filter moves with the angle, and each ray sees its own.

The cone of f-number F has the half angle a = asin(1 / 2F) around the chief ray, which falls in at the chief ray angle
c. Its rays are weighted by their projected solid angle, cos t sin t dt dp. At the angle t from the normal it holds the
azimuths |p| <= P(t), cos P = (cos a - cos c cos t) / (sin c sin t). A ray at t meets a transmission T(l m), where
m = 1 / sqrt(1 - (sin t / n)^2) for the effective index n (Smith, Modern Optical Engineering).

A channel's curve is N = base T. What is below the coating, the base, stays; T moves: N(l; t) = base(l) T(l m(t)). T is
known at the grid's wavelengths where the base lets light through; it is linear between them, and beyond the last of
them at either end it stays what it is there. So the mean over all rays is linear in N: a matrix for each channel. It
may as well be applied to the light: the curve sees, at normal incidence, light that is moved the other way.

A transmission that is linear between knots is averaged over all rays without any sampling of it: that takes no more
than the share of rays whose m lies between two numbers, and their mean m. Both are integrals of smooth functions
between the ends of the cone, taken by Gauss-Legendre rules that are exact to rounding.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..base.cache import Cache
from ..base.errors import Fault
from ..base.types import (
    Array,
    Float,
    FloatArray,
    IndexArray,
    Int,
    PerKnot,
    PerValue,
    PerWavelength,
    SameShape,
)
from .scene import Scene
from .setup import Setup

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

_PANELS, _ORDER = 96, 8
"""Panels of each arc of the cone at least, and points of the Gauss-Legendre rule in each."""
_RULE = np.polynomial.legendre.leggauss(_ORDER)
_FEWER = 400
"""Rays from which a rule with fewer is made."""


@dataclass(frozen=True)
class Cone:
    """Cone of rays.

    `half_rad`: half angle, below 90 degrees, rad; `chief_rad`: angle of the chief ray to the normal, below 90 degrees,
    rad.
    """

    half_rad: float
    chief_rad: float


def half_angle_rad(f_number: float) -> float:
    """Return the half angle of a lens's cone, asin(1 / 2F).

    `f_number`: f-number; a lens faster than f/0.5 has all directions.
    """
    return math.asin(min(1.0, 0.5 / f_number))


def stretch(sine_squared: SameShape, index: float) -> SameShape:
    """Return m: the transmission at wavelength l is that at l m for normal incidence.

    Returns m, at least 1.
    """
    return np.asarray(1 / np.sqrt(1 - sine_squared / index**2), dtype=float)


@dataclass(frozen=True)
class _Arc:
    """Part of a cone, parametrized by a number from 0 to 1 that grows with the angle."""

    sine_squared: Callable[[SameShape], SameShape]
    density: Callable[[SameShape], SameShape]
    place: Callable[[SameShape], SameShape]


def _arcs(cone: Cone) -> list[_Arc]:
    """Return the parts of a cone with all azimuths and with some, as far as they exist."""
    half, chief = cone.half_rad, cone.chief_rad
    area = math.sin(half) ** 2 * math.cos(chief)  # of the cone's projected solid angle, over pi
    arcs = []
    if chief < half:
        inner = math.sin(half - chief) ** 2
        arcs.append(_Arc(lambda u: inner * u, lambda u: np.full(u.shape, inner / area), lambda x: x / inner))
    if chief > 0:
        # t = middle - width cos(pi u): the roots at both ends of P(t) become smooth.
        middle, width = max(half, chief), min(half, chief)

        def angle(u: SameShape) -> SameShape:
            return np.asarray(middle - width * np.cos(math.pi * u))

        def density(u: SameShape) -> SameShape:
            t = angle(u)
            across = math.sin(chief) * np.sin(t)
            cosine = np.divide(
                math.cos(half) - math.cos(chief) * np.cos(t), across, out=np.zeros_like(t), where=across > 0
            )
            azimuth = np.arccos(np.clip(cosine, -1.0, 1.0)) / math.pi
            return np.asarray(2 * azimuth * np.sin(t) * np.cos(t) * width * math.pi * np.sin(math.pi * u) / area)

        def place(x: SameShape) -> SameShape:
            t = np.arcsin(np.sqrt(np.clip(x, 0.0, 1.0)))
            return np.asarray(np.arccos(np.clip((middle - t) / width, -1.0, 1.0)) / math.pi)

        arcs.append(_Arc(lambda u: np.sin(angle(u)) ** 2, density, place))
    return arcs


def _points(edges: PerValue) -> tuple[Float[Array, "rays points"], Float[Array, "rays points"]]:
    """Return Gauss-Legendre points and weights between neighboring edges."""
    node, weight = _RULE
    half = np.diff(edges)[:, None] / 2
    return edges[:-1, None] + half * (1 + node), half * weight


def gauss_rays(cone: Cone, count: int) -> tuple[Float[Array, " count"], Float[Array, " count"]]:
    """Return a few rays that stand for the cone.

    The Gauss rule of the cone's own distribution: exact for polynomials of the squared sine of degree 2 count - 1.

    Returns squared sines of their angles, and weights that sum to 1.
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
    """Distribution of the stretch m over the rays of a cone."""

    def __init__(self, cone: Cone, index: float) -> None:
        self._index = index
        self._arcs = _arcs(cone)
        ends = np.array([[arc.sine_squared(np.array([end]))[0] for end in (0.0, 1.0)] for arc in self._arcs])
        self.least, self.most = stretch(np.array([ends.min(), ends.max()]), index)

    def below(self, m: PerValue) -> tuple[PerValue, PerValue]:
        """Return the share of rays with a smaller stretch, and the sum of their stretches.

        `m`: stretches, ascending.
        """
        shares, sums = np.zeros(m.size), np.zeros(m.size)
        sine_squared = np.clip(1 - 1 / np.maximum(m, 1.0) ** 2, 0.0, 1.0) * self._index**2
        for arc in self._arcs:
            ends = np.clip(arc.place(sine_squared), 0.0, 1.0)
            edges = np.union1d(np.linspace(0.0, 1.0, _PANELS + 1), ends)
            at, weight = _points(edges)
            rays_there = arc.density(at) * weight
            moved = rays_there * stretch(arc.sine_squared(at), self._index)
            where = np.searchsorted(edges, ends)
            shares += np.append(0.0, np.cumsum(rays_there.sum(axis=1)))[where]
            sums += np.append(0.0, np.cumsum(moved.sum(axis=1)))[where]
        return shares, sums


_STEEPEST_RAD = math.radians(85.0)
_Entries = tuple[IndexArray, IndexArray, FloatArray]
"""Rows, columns and values of a sparse matrix."""
_LEAST_BASE = 1e-9
"""A filter is not known where its base lets less than this share of its largest value through."""


def cone_of(scene: Scene) -> Cone:
    """Return the cone of rays of a scene's lens."""
    return Cone(half_angle_rad(scene.optics.f_number), math.radians(scene.optics.cra_deg))


def grazing_fault(scene: Scene) -> Fault | None:
    """Return the fault of a scene whose rays graze an interference filter; None if they do not."""
    chief_deg = scene.optics.cra_deg if scene.field is None else scene.field.steepest_deg
    steepest = cone_of(scene).half_rad + math.radians(chief_deg)
    if steepest <= _STEEPEST_RAD:
        return None
    problem = "the steepest ray grazes a filter whose technology is interference"
    allowed = f"at most {math.degrees(_STEEPEST_RAD):g} degrees from f_number and cra_deg together"
    return Fault(("optics",), problem, f"{math.degrees(steepest):.3g} degrees", allowed)


class AngularResponse:
    """Angular response of the filters of a setup in the cone of its lens."""

    def __init__(self, setup: Setup) -> None:
        self.matrices: dict[int, csr_matrix] = {}
        """Matrix of each channel that moves: its curve as seen is matrix @ curve."""
        if setup.computes("angle"):
            cone, wave, rays = cone_of(setup.scene), setup.camera.grid.nodes_nm, setup.accuracy.rays
            self.matrices = {
                c: _matrix(wave, setup.camera.base_transmission(c), setup.camera.effective_index(c), cone, rays)
                for c in setup.camera.moving
            }

    def curves(
        self, qe: Float[Array, "*batch channels wavelengths"], channels: Sequence[int]
    ) -> Float[Array, "*batch channels wavelengths"]:
        """Return curves averaged over the cone of rays."""
        return self._applied(qe, channels, of_light=False)

    def light(
        self, light: Float[Array, "*batch spectra wavelengths"], channels: Sequence[int]
    ) -> Float[Array, "*batch spectra wavelengths"]:
        """Return weights of curves at normal incidence from weights of curves in the cone."""
        return self._applied(light, channels, of_light=True)

    def _applied(
        self, values: Float[Array, "*batch wavelengths"], channels: Sequence[int], *, of_light: bool
    ) -> Float[Array, "*batch wavelengths"]:
        if not any(channel in self.matrices for channel in channels):
            return values
        result = np.array(values, dtype=float)
        for at, channel in enumerate(channels):
            if channel in self.matrices:
                matrix = self.matrices[channel].T if of_light else self.matrices[channel]
                flat = result[..., at, :].reshape(-1, result.shape[-1])
                result[..., at, :] = (matrix @ flat.T).T.reshape(result[..., at, :].shape)
        return result


def known_at(base_transmission: PerWavelength) -> Int[IndexArray, " wavelengths"]:
    """Return the wavelengths at which a base transmission is large enough to know the filter on it."""
    return np.flatnonzero(base_transmission > _LEAST_BASE * base_transmission.max())


_MATRICES: Cache[bytes, csr_matrix] = Cache(256)


def _matrix(
    wavelength_nm: PerWavelength, base_transmission: PerWavelength, index: float, cone: Cone, n_rays: int | None
) -> csr_matrix:
    """Return the matrix from a curve on a base transmission to the curve in the cone; cached."""
    key = wavelength_nm.tobytes() + base_transmission.tobytes() + repr((index, cone, n_rays)).encode()

    def compute() -> csr_matrix:
        from scipy.sparse import csr_matrix, diags_array  # noqa: PLC0415  (slow to import: only where filters move)

        known = known_at(base_transmission)
        rows, columns, shares = _means(wavelength_nm, wavelength_nm[known], index, cone, n_rays)
        shape = (wavelength_nm.size, wavelength_nm.size)
        mean = csr_matrix((shares, (rows, known[columns])), shape=shape)
        inverse = np.zeros(base_transmission.size)
        inverse[known] = 1 / base_transmission[known]
        return csr_matrix(diags_array(base_transmission) @ mean @ diags_array(inverse))

    return _MATRICES.get(hashlib.sha256(key).digest(), compute)


def _means(wavelength_nm: PerWavelength, knots_nm: PerKnot, index: float, cone: Cone, n_rays: int | None) -> _Entries:
    """Return the mean over the rays of a transmission given at knots, as rows, columns and values of a matrix.

    Values are 0 or more, and those of each row (a wavelength) sum to 1; columns are knots.
    """
    if n_rays is None and knots_nm.size > 1:
        return _over_cone(wavelength_nm, knots_nm, Stretches(cone, index))
    sine_squared, weights = gauss_rays(cone, n_rays or 1)
    return _over_rays(wavelength_nm, knots_nm, stretch(sine_squared, index), weights)


def _over_rays(
    wavelength_nm: PerWavelength, knots_nm: PerKnot, m: Float[Array, " rays"], weights: Float[Array, " rays"]
) -> _Entries:
    """Return the mean over single rays."""
    at = np.clip(wavelength_nm[:, None] * m, knots_nm[0], knots_nm[-1])
    first = np.clip(np.searchsorted(knots_nm, at, side="right") - 1, 0, max(knots_nm.size - 2, 0))
    last = np.minimum(first + 1, knots_nm.size - 1)
    step_nm = knots_nm[last] - knots_nm[first]
    share = np.divide(at - knots_nm[first], step_nm, out=np.zeros_like(at), where=step_nm > 0)
    rows = np.broadcast_to(np.arange(wavelength_nm.size)[:, None], at.shape)
    shares = np.concatenate([(weights * (1 - share)).ravel(), (weights * share).ravel()])
    return np.tile(rows.ravel(), 2), np.concatenate([first.ravel(), last.ravel()]), shares


def _over_cone(wavelength_nm: PerWavelength, knots_nm: PerKnot, stretches: Stretches) -> _Entries:
    """Return the mean over all rays: for each pair of knots the share of rays between them, and their mean position."""
    last = knots_nm.size - 1
    low = np.clip(np.searchsorted(knots_nm, wavelength_nm * stretches.least, side="right") - 1, 0, last)
    high = np.clip(np.searchsorted(knots_nm, wavelength_nm * stretches.most), 0, last)
    columns = np.minimum(low[:, None] + np.arange(int((high - low).max()) + 2), last)
    knots = knots_nm[columns]
    m, which = np.unique(knots / wavelength_nm[:, None], return_inverse=True)
    share, summed = (values[which].reshape(columns.shape) for values in stretches.below(m))
    total = stretches.below(np.array([stretches.most]))[0][0]
    there, moved, steps = np.diff(share), np.diff(summed), np.diff(knots)
    second = np.divide(
        wavelength_nm[:, None] * moved - knots[:, :-1] * there, steps, out=np.zeros_like(there), where=steps > 0
    )
    second = np.clip(second, 0.0, there)
    shares = np.zeros(columns.shape)
    shares[:, 0] += share[:, 0]
    shares[:, :-1] += there - second
    shares[:, 1:] += second
    shares[:, -1] += np.maximum(total - share[:, -1], 0.0)
    shares /= shares.sum(axis=1, keepdims=True)
    rows = np.broadcast_to(np.arange(wavelength_nm.size)[:, None], columns.shape)
    return rows.ravel(), columns.ravel(), shares.ravel()
