"""Sums over Bessel functions of radii times frequencies, of which an image needs millions: from a table.

Each function is a Taylor polynomial of the seventh order on pieces of 1/16. None of its derivatives is larger than 1,
so that the polynomial is off by less than (1/32)^8 / 8! = 2e-17. Such sums are even functions of the radius without
finer detail than their highest frequency: those at a few radii tell all others (`FewRadii`).
"""

from __future__ import annotations

import math

import numpy as np

from ..base.cache import Cache
from ..base.types import FloatArray
from . import chebyshev

_PER_UNIT = 16
_ORDER = 7
_AT_ONCE = 128
"""Radii whose values are held at once: they stay in the processor's cache."""
_LEAST = 64.0
"""What a table reaches to at least."""


def _pieces(most: float, power: int) -> FloatArray:
    """Of J0 (`power` 0) or J1(x) / x (`power` 1) up to some number, ndarray[n_pieces, 8]: see `compiled_bessel`.

    J_p(x) / x^p = f obeys x f'' + (1 + 2 p) f' + x f = 0, which gives each coefficient from the three before it.
    """
    from scipy.special import j0, j1  # noqa: PLC0415  (slow to import: kept off the start-up path)

    half = 0.5 / _PER_UNIT
    x = half * (2 * np.arange(math.ceil(most * _PER_UNIT) + 1) + 1)
    zeroth, first = j0(x), j1(x)
    found = np.zeros((x.size, _ORDER + 1))
    if power == 0:
        found[:, 0], found[:, 1] = zeroth, -half * first
    else:
        found[:, 0], found[:, 1] = first / x, -half * (2 * first / x - zeroth) / x
    for n in range(_ORDER - 1):
        before = found[:, n - 1] if n else 0.0
        rest = (n + 1) * (n + 1 + 2 * power) * found[:, n + 1] * half + (x * found[:, n] + half * before) * half**2
        found[:, n + 2] = -rest / (x * ((n + 2) * (n + 1)))
    return found


_TABLES: Cache[tuple[int, int], FloatArray] = Cache(8)


def _table(most: float, power: int) -> FloatArray:
    """`_pieces` up to at least some number, kept for a few powers of two of it."""
    doublings = max(0, math.ceil(math.log2(max(most, _LEAST) / _LEAST)))
    return _TABLES.get((power, doublings), lambda: _pieces(_LEAST * 2**doublings, power))


def _sums(radii: FloatArray, frequencies: FloatArray, spectrum: FloatArray, power: int) -> FloatArray:
    from .compiled_bessel import of_products  # noqa: PLC0415  (compiled: kept off the start-up path)

    angular = 2 * math.pi * frequencies
    pieces = _table(float(radii.max() * angular[-1]), power)
    found = np.empty((radii.size, spectrum.shape[1]))
    values = np.empty((_AT_ONCE, frequencies.size))
    for at in range(0, radii.size, _AT_ONCE):
        own = radii[at : at + _AT_ONCE]
        of_products(own, angular, pieces, float(_PER_UNIT), values[: own.size])
        np.matmul(values[: own.size], spectrum, out=found[at : at + own.size])
    return found


def sums_of_j0(radii: FloatArray, frequencies: FloatArray, spectrum: FloatArray) -> FloatArray:
    """Sums over frequencies (ndarray[n], ascending) of J0(2 pi radius frequency) times a spectrum, ndarray[n, m].

    `radii`: ndarray[n_radii], none negative; ndarray[n_radii, m].
    """
    return _sums(radii, frequencies, spectrum, 0)


def sums_of_j1_over_x(radii: FloatArray, frequencies: FloatArray, spectrum: FloatArray) -> FloatArray:
    """`sums_of_j0` of J1(x) / x with x = 2 pi radius frequency."""
    return _sums(radii, frequencies, spectrum, 1)


class FewRadii:
    """A few radii, at which sums tell those at all of some, ascending from 0 on: `nodes`, ndarray[n_nodes].

    J0(z x) has 2 J_k(z / 2)^2 of Chebyshev's polynomial of the order 2 k, and J1(z x) / (z x), a mean of cos(z x sin a)
    over angles a, at most 2 |J_2k(z)|. Both fall fast from k = z / 2 on: what is left out is less than 1e-15.
    """

    def __init__(self, radii: FloatArray, highest: float) -> None:
        """`highest`: frequency."""
        last, finest = float(radii[-1]), math.pi * highest * float(radii[-1])
        self._order = math.ceil(finest + 6 * finest ** (1 / 3) + 8)
        self.nodes = last * np.sqrt((1 + chebyshev.roots(self._order)) / 2)
        self._angles = 2 * np.arccos(radii / last)

    @property
    def growth(self) -> float:
        """How many times its largest value at these a sum may be between them."""
        return chebyshev.growth(self._order)

    def to_all(self, values: FloatArray) -> FloatArray:
        """Values at all radii from those at the few, ndarray[n_nodes, m] -> ndarray[n_radii, m]."""
        shares = chebyshev.to_orders(self._order) @ values
        return np.asarray(chebyshev.polynomials(self._angles, self._order) @ shares)
