"""Members of a population of lights that come too near, as a limit's linear programs know them: only those that bind.

A filter must keep every two members apart, and there are endlessly many. A program that knows some of them has no fewer
filters, so that what no filter of it exceeds holds for all members, too. Its best filter says which members to add: the
nearest ones, found exactly; until they are no nearer than those that the program knows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..metrics.members import population_imager
from ..types import BoolArray, FloatArray, IndexArray
from .problem import Problem

_NEARER_DN = 0.01
"""Members that are nearer than all known ones by no more than this are not added."""


@dataclass(frozen=True)
class _Known:
    """Two members each: place of the field, the spectra below their shifts, and the shares above, ndarray[n, 2]."""

    case: IndexArray
    below: IndexArray
    share: FloatArray

    def joined(self, others: _Known, some: BoolArray) -> _Known:
        """These and some of others."""
        return _Known(
            np.concatenate([self.case, others.case[some]]),
            np.concatenate([self.below, others.below[some]]),
            np.concatenate([self.share, others.share[some]]),
        )

    def difference(self, values: FloatArray) -> FloatArray:
        """First minus second member; `values`: ndarray[n_cases, n_spectra, n] -> ndarray[n_known, n]."""
        low, high = (values[self.case[:, None], self.below + step] for step in (0, 1))
        both = low + self.share[..., None] * (high - low)
        return np.asarray(both[:, 0] - both[:, 1], dtype=float)


class MemberPairs:
    """The members that are known of each worst case over the population; first, the nearest ones of the base curve."""

    def __init__(self, problem: Problem, names: Sequence[str]) -> None:
        self._seen, self.names = population_imager(problem.view), tuple(names)
        self._types = {name: pair for name in names if (pair := problem.quantities[name].pair) is not None}
        imager, channel, base = self._seen.imager, problem.view.modified[0], problem.view.base_qe
        self._gain = imager.per_qe(0, base)[:, :, channel]
        self._others = np.delete(imager.smooth(base[None])[0], channel, axis=2)
        self._known = {name: self._nearest(name, base[0])[0] for name in names}

    def rows(self, name: str) -> tuple[FloatArray, FloatArray]:
        """Of each two known members: difference in the modified channel, DN per QE, ndarray[n, n_wavelengths].

        Second, their squared distance in the other channels, ndarray[n].
        """
        known = self._known[name]
        return known.difference(self._gain), (known.difference(self._others) ** 2).sum(axis=1)

    def least_known(self, name: str, curve: FloatArray) -> float:
        """The smallest distance of known members for a filter, ndarray[n_wavelengths]; DN."""
        apart, squared = self.rows(name)
        return float(np.sqrt(((apart @ curve) ** 2 + squared).min()))

    def least(self, name: str, curve: FloatArray) -> float:
        """The smallest distance of all members for a filter, DN."""
        return float(np.sqrt(self._nearest(name, curve)[1].min()))

    def more(self, curve: FloatArray) -> bool:
        """Add the nearest members for a filter; False where they are no nearer than the known ones."""
        added = False
        for name in self.names:
            found, squared = self._nearest(name, curve)
            nearer = np.sqrt(squared) < self.least_known(name, curve) - _NEARER_DN
            if nearer.any():
                added, known = True, self._known[name]
                self._known[name] = known.joined(found, nearer)
        return added

    def _nearest(self, name: str, curve: FloatArray) -> tuple[_Known, FloatArray]:
        """The nearest members of each two lights and part of their shifts for a filter, and their squared distances."""
        response = self._seen.imager.smooth(curve[None, None])[0]
        parts = []
        for case, values in enumerate(response):
            near = self._seen.nearest(values, self._types[name], parts=self._seen.parts)
            one, other, part = np.nonzero(np.isfinite(near.squared))
            below = near.steps[one, other, part] + np.stack([near.first[one], near.second[other]], axis=1)
            share = near.shares[one, other, part]
            parts.append((np.full(one.size, case), below, share, near.squared[one, other, part]))
        cases, spectra, shares, squared = (np.concatenate(each) for each in zip(*parts, strict=True))
        return _Known(cases, spectra, shares), squared
