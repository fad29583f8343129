"""The light of a blurred disc within a radius, as a table: what a pixel gets of it is a sum over the pixel's edges.

With g(r) = (1 / r^2) integral_0^r h(s) s ds the field g(r) (x, y) has the divergence h. So by Gauss's theorem the mean
of h over a pixel is that of the field over its edges: an integral along lines instead of one over an area. Of
h(r) = integral A(nu) J0(2 pi r nu) dnu it is g(r) = integral A(nu) J1(2 pi r nu) / (2 pi r nu) dnu.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ..base.cache import Cache
from ..base.types import FloatArray
from .bessel import FewRadii, sums_of_j1_over_x
from .effects.blur import Profile
from .splines import spline_through

_RESIDUAL = 1e-10
"""No value of the image is further from its expansion, relative to that of a uniform field."""
_LANES = 4
"""Functions are filled up to a multiple of so many."""
BEYOND = 24
"""Nodes behind the profile's end: near the table's end its spline is not uniform."""
_MIRRORED = 10
"""Nodes before the first, for the same reason."""


class Encircled:
    """g(r) of a few functions of the radius, of which the image at every wavelength is a sum.

    `shares`: ndarray[n_functions, n_wavelengths], how much of each function is in each wavelength.
    """

    def __init__(self, profile: Profile) -> None:
        self._profile = profile
        kept = profile.n_functions(_RESIDUAL)
        self.shares = np.zeros((-(-kept // _LANES) * _LANES, profile.shares.shape[1]))
        self.shares[:kept] = profile.shares[:kept]

    @cached_property
    def coefficients(self) -> FloatArray:
        """Of a uniform spline of the fifth order, from the second node before a radius of nothing on; the nodes are
        those of the profile. ndarray[n_nodes, n_functions].
        """
        r_um, (nu, spectrum) = self._profile.r_um, self._profile.spectrum
        few = FewRadii(np.arange(r_um.size + BEYOND) * r_um[1], float(nu[-1]))
        return uniform_spline(few.to_all(sums_of_j1_over_x(few.nodes, nu, spectrum @ self.shares.T)))


def uniform_spline(values: FloatArray) -> FloatArray:
    """Coefficients of a spline of the fifth order, from the second node before the first value on.

    `values`: ndarray[n_nodes, n_functions], of even functions at equidistant nodes from 0 on.
    """
    mirrored = np.concatenate([values[_MIRRORED:0:-1], values])
    _, found = spline_through(np.arange(-_MIRRORED, len(values), dtype=float), mirrored, 5)
    return np.ascontiguousarray(found[_MIRRORED - 2 : -2])


ENCIRCLED: Cache[Profile, Encircled] = Cache(8)


def encircled(profile: Profile) -> Encircled:
    """That of a profile, kept."""
    return ENCIRCLED.get(profile, lambda: Encircled(profile))
