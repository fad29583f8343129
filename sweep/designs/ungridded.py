"""Designs that are no grid: drawn from a box, or listed. Each follows from its number alone."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from ..base.cache import Cache
from ..base.types import Array, Float, FloatArray

Axes = tuple[tuple[float, ...], ...]
Method = Literal["sobol", "lhs"]

_KEPT = 2


class ListedDesigns(Protocol):
    """Designs over the values of each parameter."""

    @property
    def size(self) -> int:
        """Number of designs."""

    def points(self, axes: Axes, start: int, stop: int) -> Float[Array, "_designs parameters"]:
        """Return the parameters of consecutive designs."""


@dataclass(frozen=True)
class PairedDesigns:
    """Designs of which the i-th has the i-th value of every axis; an axis of one value holds for all."""

    size: int

    def points(self, axes: Axes, start: int, stop: int) -> Float[Array, "_designs parameters"]:
        """Return the parameters of consecutive designs."""
        columns = [np.asarray(axis[start:stop] if len(axis) > 1 else axis * (stop - start)) for axis in axes]
        return np.stack(columns, axis=1).astype(float)


def sobol_points(dimensions: int, count: int, seed: int) -> Float[Array, "count dimensions"]:
    """Return the first points of a scrambled Sobol sequence."""
    from scipy.stats import qmc  # noqa: PLC0415  (slow to import; only drawn designs and searches need it)

    # In a thread of its own, which takes no signals: SciPy prints a traceback if Ctrl-C reaches it while it reads its
    # direction numbers, and goes on.
    with ThreadPoolExecutor(1) as thread:
        sobol = thread.submit(qmc.Sobol, dimensions, scramble=True, rng=np.random.default_rng(seed)).result()
    return np.asarray(sobol.random_base2(max(1, (count - 1).bit_length()))[:count], dtype=float)


@dataclass(frozen=True)
class SampledDesigns:
    """Designs between the smallest and largest value of every axis, by SciPy's `qmc`.

    `method`: `sobol`, the first points of a scrambled Sobol sequence, so that fewer designs are the first of more; or
    `lhs`, a Latin hypercube.
    """

    method: Method
    size: int
    seed: int

    def points(self, axes: Axes, start: int, stop: int) -> Float[Array, "_designs parameters"]:
        """Return the parameters of sampled designs; the whole sample is drawn at the first call and kept."""
        shares = _drawn.get((self, len(axes)), lambda: self._shares(len(axes)))[start:stop]
        low, high = (np.array([end(axis) for axis in axes], dtype=float) for end in (min, max))
        return np.asarray(np.minimum(low + shares * (high - low), high), dtype=float)

    def _shares(self, n_parameters: int) -> Float[Array, "_size _parameters"]:
        """Return points of the unit cube."""
        if self.method == "sobol":
            return sobol_points(n_parameters, self.size, self.seed)
        from scipy.stats import qmc  # noqa: PLC0415  (slow to import; only a study that draws designs needs it)

        random = np.random.default_rng(self.seed)
        return np.asarray(qmc.LatinHypercube(d=n_parameters, rng=random).random(self.size), dtype=float)


_drawn: Cache[tuple[SampledDesigns, int], FloatArray] = Cache(_KEPT)
