"""The light of pixels of a blurred round image, wherever they are: a table for images that are asked for many places.

The mean over a square pixel, as a function of where its center is, has the square's symmetry: it is a sum over k of
a_k(r) cos(4 k angle). Its finest detail is the image's, so that of k few are needed, and within a ring of a pixel's
width few functions of the radius tell all wavelengths apart.
"""

from __future__ import annotations

import math

import numpy as np

from ..base.cache import Cache
from ..base.types import FloatArray
from . import legendre
from .compiled_light import Table
from .compiled_pixels import Rings, means_on_rays
from .effects.blur import Profile
from .encircled import BEYOND, encircled, uniform_spline

_RESIDUAL = 1e-10
"""No harmonic or function of the radius that is left out is larger, relative to a uniform field."""
_EDGE_LESS = 2
"""An integral along an edge needs so many nodes less than one over a pixel, along each axis."""
_LANES = 4
"""Functions are filled up to a multiple of so many."""
_FEW_RADII = 8
"""So much further apart than the nodes of a spline, radii still tell which harmonics an image has."""
_FINE = 32
"""Nodes per pixel from which on those of a ring are told by every fourth."""


def edge_rule(profile: Profile, half_um: float) -> tuple[FloatArray, FloatArray]:
    """Nodes and weights of integrals along a pixel's edge."""
    return legendre.rule(profile.order(2 * half_um) - _EDGE_LESS)


def _rings(profile: Profile, half_px: float, pitch_um: float) -> Rings:
    light, per_px = encircled(profile), pitch_um / float(profile.r_um[1])
    # Half of the nodes beyond are for the corners of pixels whose centers are on the other half.
    radii = np.arange(profile.r_um.size + BEYOND // 2 - math.ceil(2**0.5 * half_px * per_px)) / per_px
    finest = 2 * math.pi * 2**0.5 * half_px * profile.highest_per_um * pitch_um
    most = math.ceil((finest + 4 * finest ** (1 / 3) + 16) / 4)  # J_n(x) falls fast from n = x on
    sizes = half_px, (light.coefficients, per_px), edge_rule(profile, half_px * pitch_um)
    # Images have next to nothing of their finest detail, so that a few radii tell how much fewer harmonics there are.
    needed = _n_above(_harmonics(radii[::_FEW_RADII], most, *sizes), _RESIDUAL / 4)
    harmonics = _harmonics(radii, min(needed + 1, most), *sizes)
    n = _n_above(harmonics, _RESIDUAL)
    return _compressed(harmonics[:, :n], per_px)


def _harmonics(
    radii: FloatArray, most: int, half_px: float, table: Table, rule: tuple[FloatArray, FloatArray]
) -> FloatArray:
    """The first `most` + 1 harmonics a_k of the mean over a pixel, ndarray[n_radii, most + 1, n_functions]; there are
    no more than twice as many.
    """
    k = np.arange(most + 1)
    values = np.empty((radii.size, k.size, table[0].shape[1]))
    means_on_rays(radii, np.asarray(k * (math.pi / 4 / most), dtype=float), half_px, table, rule, values)
    cosines = np.cos(math.pi / most * np.outer(k, k)) * (2 / most)
    cosines[:, [0, -1]] /= 2
    cosines[[0, -1]] /= 2
    return np.asarray(np.matmul(cosines, values))


def _n_above(harmonics: FloatArray, residual: float) -> int:
    """How many harmonics there are up to the last that is larger."""
    return 1 + int(np.flatnonzero(np.abs(harmonics).max(axis=(0, 2)) > residual)[-1])


def _compressed(harmonics: FloatArray, per_px: float) -> Rings:
    """Rings of functions of the radius at its nodes, ndarray[n_radii, n_harmonics, n_functions]."""
    n_radii, n_harmonics, n_functions = harmonics.shape
    n_rings = max(1, int((n_radii - 1) / per_px))
    starts = (np.arange(n_rings) * per_px).astype(int)
    ends = np.append(starts[1:] + 2, n_radii - 6 + 2)
    every = uniform_spline(harmonics.reshape(n_radii, -1)).reshape(-1, n_harmonics, n_functions)
    step, n_before, n_coefficients = 4 if per_px >= _FINE else 1, 0, 0
    coefficients, shares, sizes = [], [], []
    for start, end in zip(starts, ends, strict=True):
        own = every[start : end + 6]
        _, strengths, basis = np.linalg.svd(own[::step].reshape(-1, n_functions), full_matrices=False)
        kept = basis[: max(1, int((strengths > _RESIDUAL).sum()))]
        basis = np.zeros((-(-len(kept) // _LANES) * _LANES, n_functions))
        basis[: len(kept)] = kept
        by_function = own @ basis.T
        few = _n_above(by_function, _RESIDUAL)
        coefficients.append(by_function[:, :few].ravel())
        shares.append(basis)
        sizes.append((n_coefficients, start, few, len(basis), n_before))
        n_before, n_coefficients = n_before + len(basis), n_coefficients + coefficients[-1].size
    return Rings(np.concatenate(coefficients), np.array(sizes), np.concatenate(shares), per_px)


RINGS: Cache[tuple[Profile, float], Rings] = Cache(8)


def rings(profile: Profile, half_px: float, pitch_um: float) -> Rings:
    """Those of a profile for pixels of a size, kept. `half_px`: half of a pixel's light-sensitive side."""
    return RINGS.get((profile, half_px), lambda: _rings(profile, half_px, pitch_um))
