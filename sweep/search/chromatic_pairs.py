"""Pairs of signals for the upper bound on a chromatic separation.

The chromatic distance of two signals is min over a in [0, 1] of |y1 - a y2| and |a y1 - y2|. For any fixed brightness a
the difference is linear in the filter, and no chromatic distance exceeds it, so every known a is a valid row of the
linear programs. The worst brightness of a filter near the bound is added until none is nearer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..base.types import Array, Float, IndexArray, Int, PerWavelength
from ..camera.linear import linear_model
from .member_pairs import KnownPairs
from .perturbed import Distances
from .problem import Problem

_NEARER_DN = 0.001
"""A brightness counts as new if the distance is smaller by this."""


@dataclass(frozen=True)
class _Known(KnownPairs):
    """Pairs with a brightness each: case, first and second signal, factors of both responses."""

    case: Int[IndexArray, " known"]
    first: Int[IndexArray, " known"]
    second: Int[IndexArray, " known"]
    factors: Float[Array, "known 2"]

    def difference(self, values: Float[Array, "cases spectra channels"]) -> Float[Array, "known channels"]:
        """Return first minus second signal, each times its factor."""
        first_values, second_values = values[self.case, self.first], values[self.case, self.second]
        return np.asarray(self.factors[:, :1] * first_values - self.factors[:, 1:] * second_values, dtype=float)


class ChromaticPairs:
    """Known brightnesses of each pair of signals; at first the worst ones of the base curve."""

    def __init__(self, problem: Problem, names: Sequence[str]) -> None:
        setup = problem.setup
        self.names = tuple(names)
        self._types = {name: problem.pairs[name] for name in names}
        self._members = setup.members
        model, channel, base = linear_model(setup), setup.camera.modified[0], setup.camera.base_qe
        unlit = model.unlit(base[None])[0]
        self._gain = model.per_qe(0, base, lamps_only=True)[:, :, channel]
        self._others = np.delete(model.smooth(base[None])[0] - unlit[:, None], channel, axis=2)
        self._known = {name: self._nearest(name, base[0])[0] for name in names}

    def distances(self, name: str) -> Distances:
        """Return the distances of known pairs, for every filter."""
        known = self._known[name]
        squared = (known.difference(self._others) ** 2).sum(axis=1)
        return Distances(known.difference(self._gain), squared, np.zeros((squared.size, 2)))

    def counted(self, name: str, curve: PerWavelength) -> float:
        """Return the smallest distance of known pairs as the program counts it, DN."""
        return self.distances(name).least(curve)

    def least(self, name: str, curve: PerWavelength) -> float:
        """Return the smallest distance over all brightnesses, DN."""
        return float(self._nearest(name, curve)[1].min())

    def more(self, curve: PerWavelength) -> bool:
        """Add the worst brightnesses of a filter.

        False if no pair is nearer than the known ones.
        """
        added = False
        for name in self.names:
            pairs, distance_dn = self._nearest(name, curve)
            nearer = distance_dn < self.counted(name, curve) - _NEARER_DN
            if nearer.any():
                added, self._known[name] = True, self._known[name].joined(pairs, nearer)
        return added

    def _nearest(self, name: str, curve: PerWavelength) -> tuple[_Known, Float[Array, " known"]]:
        """Return every pair at its worst brightness, and their distances, DN."""
        first, second = (self._members[kind] for kind in self._types[name])
        case, first_signals, second_signals = (
            at.ravel() for at in np.meshgrid(range(len(self._gain)), first, second, indexing="ij")
        )
        response = np.concatenate([self._others, (self._gain @ curve)[:, :, None]], axis=2)
        a, b = response[case, first_signals], response[case, second_signals]
        squares, product = np.stack([(a * a).sum(axis=1), (b * b).sum(axis=1)]), (a * b).sum(axis=1)
        brighter = squares.argmax(axis=0)  # the brighter signal is dimmed
        larger = squares.max(axis=0)
        factors = np.ones((case.size, 2))
        ratio = np.divide(product, larger, out=np.zeros_like(product), where=larger > 0)
        factors[np.arange(case.size), brighter] = np.clip(ratio, 0.0, 1.0)
        differences = factors[:, :1] * a - factors[:, 1:] * b
        return _Known(case, first_signals, second_signals, factors), np.sqrt((differences**2).sum(axis=1))
