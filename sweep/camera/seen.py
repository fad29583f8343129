"""Filters as the rays of a lens see them: an interference filter moves with the angle, and each ray sees its own.

A channel's curve is N = base T. What is below the coating, the base, stays; T moves: N(l; t) = base(l) T(l m(t)), see
`rays`. T is known at the grid's wavelengths where the base lets light through; it is linear between them, and beyond
the last of them at either end it stays what it is there. So the mean over all rays is linear in N: a matrix for each
channel. It may as well be applied to the light: the curve sees, at normal incidence, light that is moved the other way.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..base.cache import Cache
from ..base.types import FloatArray, IndexArray
from .rays import Cone, Stretches, half_angle_rad, rays, stretch
from .scene import Scene
from .shot import Shot

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

SKIP, CHIEF, CONE = "skip", "chief ray", "cone"
RAYS = {"4 rays": 4, "16 rays": 16}
METHODS = (SKIP, CHIEF, *RAYS, CONE)
"""From the cheapest to the mean over the whole cone, which is exact to rounding."""
_Entries = tuple[IndexArray, IndexArray, FloatArray]
"""Rows, columns and values of a sparse matrix, ndarray[n] each."""
_LEAST_BASE = 1e-9
"""Where the base lets less of its largest value through, what is on it is not known."""


def cone_of(scene: Scene) -> Cone:
    """The rays of a scene's lens."""
    return Cone(half_angle_rad(scene.optics.f_number), math.radians(scene.optics.cra_deg))


def moves(shot: Shot) -> bool:
    """Whether any filter of a shot moves with the angle of the light."""
    return any(math.isfinite(shot.effective_index(channel)) for channel in range(len(shot.mosaic.channels)))


class SeenFilters:
    """The filters of a shot as its rays see them by a method, and the light as the filters see it."""

    def __init__(self, shot: Shot, method: str) -> None:
        moved = [c for c in range(len(shot.mosaic.channels)) if math.isfinite(shot.effective_index(c))]
        self._size = shot.grid.size
        self.matrices: dict[int, csr_matrix] = {}
        """Of each channel that moves, [n_wavelengths, n_wavelengths]: its curve as seen is matrix @ curve."""
        if method != SKIP:
            cone, wave = cone_of(shot.scenario), shot.grid.nodes_nm
            self.matrices = {c: _matrix(wave, shot.carrier(c), shot.effective_index(c), cone, method) for c in moved}

    def matrix(self, channel: int) -> csr_matrix:
        """That of a channel, whether it moves or not."""
        if channel in self.matrices:
            return self.matrices[channel]
        from scipy.sparse import csr_matrix, eye_array  # noqa: PLC0415  (slow to import: only where filters move)

        return csr_matrix(eye_array(self._size))

    def curves(self, qe: FloatArray, channels: Sequence[int]) -> FloatArray:
        """Curves of some channels, ndarray[..., n, n_wavelengths], as the rays see them."""
        return self._applied(qe, channels, of_light=False)

    def light(self, light: FloatArray, channels: Sequence[int]) -> FloatArray:
        """Weights of curves as seen, ndarray[..., n, n_wavelengths], as weights of the curves themselves."""
        return self._applied(light, channels, of_light=True)

    def _applied(self, values: FloatArray, channels: Sequence[int], *, of_light: bool) -> FloatArray:
        if not any(channel in self.matrices for channel in channels):
            return values
        found = np.array(values, dtype=float)
        for at, channel in enumerate(channels):
            if channel in self.matrices:
                own = self.matrices[channel].T if of_light else self.matrices[channel]
                flat = found[..., at, :].reshape(-1, found.shape[-1])
                found[..., at, :] = (own @ flat.T).T.reshape(found[..., at, :].shape)
        return found


def known_at(carrier: FloatArray) -> IndexArray:
    """At which wavelengths a carrier lets enough light through that what is on it is known."""
    return np.flatnonzero(carrier > _LEAST_BASE * carrier.max())


MATRICES: Cache[bytes, csr_matrix] = Cache(32)


def _matrix(wavelength_nm: FloatArray, carrier: FloatArray, index: float, cone: Cone, method: str) -> csr_matrix:
    """What takes a curve on a carrier to what the rays see of it; remembered."""
    key = wavelength_nm.tobytes() + carrier.tobytes() + repr((index, cone, method)).encode()

    def made() -> csr_matrix:
        from scipy.sparse import csr_matrix, diags_array  # noqa: PLC0415  (slow to import: only where filters move)

        known = known_at(carrier)
        rows, columns, shares = _means(wavelength_nm, wavelength_nm[known], index, cone, method)
        shape = (wavelength_nm.size, wavelength_nm.size)
        mean = csr_matrix((shares, (rows, known[columns])), shape=shape)
        inverse = np.zeros(carrier.size)
        inverse[known] = 1 / carrier[known]
        return csr_matrix(diags_array(carrier) @ mean @ diags_array(inverse))

    return MATRICES.get(hashlib.sha256(key).digest(), made)


def _means(wavelength_nm: FloatArray, knots_nm: FloatArray, index: float, cone: Cone, method: str) -> _Entries:
    """The mean over the rays of a transmission that is given at knots: rows, columns and values of a matrix.

    Values are 0 or more, and those of each row (a wavelength) sum to 1; columns are knots.
    """
    if method == CONE and knots_nm.size > 1:
        found = _over_cone(wavelength_nm, knots_nm, Stretches(cone, index))
    else:
        one = np.array([math.sin(cone.chief_rad) ** 2]), np.ones(1)
        sine_squared, weights = rays(cone, RAYS[method]) if method in RAYS else one
        found = _over_rays(wavelength_nm, knots_nm, stretch(sine_squared, index), weights)
    return found


def _over_rays(wavelength_nm: FloatArray, knots_nm: FloatArray, m: FloatArray, weights: FloatArray) -> _Entries:
    """`_means` over single rays."""
    at = np.clip(wavelength_nm[:, None] * m, knots_nm[0], knots_nm[-1])
    first = np.clip(np.searchsorted(knots_nm, at, side="right") - 1, 0, max(knots_nm.size - 2, 0))
    last = np.minimum(first + 1, knots_nm.size - 1)
    apart = knots_nm[last] - knots_nm[first]
    share = np.divide(at - knots_nm[first], apart, out=np.zeros_like(at), where=apart > 0)
    rows = np.broadcast_to(np.arange(wavelength_nm.size)[:, None], at.shape)
    shares = np.concatenate([(weights * (1 - share)).ravel(), (weights * share).ravel()])
    return np.tile(rows.ravel(), 2), np.concatenate([first.ravel(), last.ravel()]), shares


def _over_cone(wavelength_nm: FloatArray, knots_nm: FloatArray, stretches: Stretches) -> _Entries:
    """`_means` over all rays: between two knots the share of the rays there, and their mean place."""
    last = knots_nm.size - 1
    low = np.clip(np.searchsorted(knots_nm, wavelength_nm * stretches.least, side="right") - 1, 0, last)
    high = np.clip(np.searchsorted(knots_nm, wavelength_nm * stretches.most), 0, last)
    columns = np.minimum(low[:, None] + np.arange(int((high - low).max()) + 2), last)
    knots = knots_nm[columns]
    m, which = np.unique(knots / wavelength_nm[:, None], return_inverse=True)
    share, summed = (values[which].reshape(columns.shape) for values in stretches.below(m))
    whole = stretches.below(np.array([stretches.most]))[0][0]
    there, moved, apart = np.diff(share), np.diff(summed), np.diff(knots)
    second = np.divide(
        wavelength_nm[:, None] * moved - knots[:, :-1] * there, apart, out=np.zeros_like(there), where=apart > 0
    )
    second = np.clip(second, 0.0, there)
    shares = np.zeros(columns.shape)
    shares[:, 0] += share[:, 0]
    shares[:, :-1] += there - second
    shares[:, 1:] += second
    shares[:, -1] += np.maximum(whole - share[:, -1], 0.0)
    shares /= shares.sum(axis=1, keepdims=True)
    rows = np.broadcast_to(np.arange(wavelength_nm.size)[:, None], columns.shape)
    return rows.ravel(), columns.ravel(), shares.ravel()
