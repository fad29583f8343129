"""Designs that are no grid: drawn from a box, or listed one by one. Each is made from its number alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from ..base.cache import Cache
from ..base.types import FloatArray

Axes = tuple[tuple[float, ...], ...]
Method = Literal["sobol", "lhs"]

_KEPT = 2


class Ungridded(Protocol):
    """Designs over the values of each parameter."""

    @property
    def size(self) -> int:
        """How many there are."""

    def points(self, axes: Axes, start: int, stop: int) -> FloatArray:
        """Parameters of designs start..stop-1: ndarray[stop - start, n_parameters]."""


@dataclass(frozen=True)
class Paired:
    """Design i has the i-th value of every axis; an axis of one value holds for all."""

    size: int

    def points(self, axes: Axes, start: int, stop: int) -> FloatArray:
        """See `Ungridded.points`."""
        columns = [np.asarray(axis[start:stop] if len(axis) > 1 else axis * (stop - start)) for axis in axes]
        return np.stack(columns, axis=1).astype(float)


@dataclass(frozen=True)
class Drawn:
    """`size` designs between the smallest and the largest value of every axis, by SciPy's `qmc`.

    `sobol`: the first ones of a scrambled Sobol sequence, so that fewer designs are the first ones of more. `lhs`: a
    Latin hypercube, which has one design in each of `size` equal parts of every axis. One seed gives one set.
    """

    method: Method
    size: int
    seed: int

    def points(self, axes: Axes, start: int, stop: int) -> FloatArray:
        """See `Ungridded.points`; all are drawn, once."""
        shares = _drawn.get((self, len(axes)), lambda: self._shares(len(axes)))[start:stop]
        low, high = (np.array([end(axis) for axis in axes], dtype=float) for end in (min, max))
        return np.asarray(np.minimum(low + shares * (high - low), high), dtype=float)

    def _shares(self, n_parameters: int) -> FloatArray:
        """Places in the box, from 0 to 1, ndarray[size, n_parameters]."""
        from scipy.stats import qmc  # noqa: PLC0415  (slow to import; only a study that draws designs needs it)

        random = np.random.default_rng(self.seed)
        if self.method == "lhs":
            return np.asarray(qmc.LatinHypercube(d=n_parameters, rng=random).random(self.size), dtype=float)
        sobol = qmc.Sobol(d=n_parameters, scramble=True, rng=random)
        return np.asarray(sobol.random_base2(max(1, (self.size - 1).bit_length()))[: self.size], dtype=float)


_drawn: Cache[tuple[Drawn, int], FloatArray] = Cache(_KEPT)
