"""Worst cases of CSDs, as a limit's linear programs know them: only those members that bind.

A filter must keep every two members of a population of lights apart, however production makes it, and there are
endlessly many. A program that knows some of them has no fewer filters, so that what no filter of it exceeds holds for
all, too. Its best filter says which to add: the nearest ones, found exactly; until they are no nearer than those that
the program knows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base.types import BoolArray, FloatArray, IndexArray
from ..curves.population import Population
from ..metrics.members import population_imager
from .problem import Problem
from .produced import Distances, Produced, ways_of

_NEARER_DN = 0.01
"""Members that are nearer than all known ones by no more than this are not added."""


@dataclass(frozen=True)
class _Known:
    """Two members each: how the filter comes out, place of the field, the spectra below their shifts, the shares above.

    The last two are ndarray[n, 2].
    """

    way: IndexArray
    case: IndexArray
    below: IndexArray
    share: FloatArray

    def joined(self, others: _Known, some: BoolArray) -> _Known:
        """These and some of others."""
        return _Known(
            np.concatenate([self.way, others.way[some]]),
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
    """The members that are known of each worst case; first, the nearest ones of the base curve.

    Without a population each light is its own only member.
    """

    def __init__(self, problem: Problem, names: Sequence[str]) -> None:
        setup = problem.setup
        if setup.lights.population is None:
            alone = Population.model_validate({"drift_nm_per_k": 0.0})
            setup = replace(setup, lights=replace(setup.lights, population=alone))
        self._seen, self.names, self._ways = population_imager(setup), tuple(names), ways_of(problem)
        self._types = {name: pair for name in names if (pair := problem.quantities[name].pair) is not None}
        imager, channel, base = self._seen.imager, problem.setup.camera.modified[0], problem.setup.camera.base_qe
        self._gain = imager.per_qe(0, base)[:, :, channel]
        self._others = np.delete(imager.smooth(base[None])[0], channel, axis=2)
        self._made: dict[str, Distances] = {}
        self._known = {name: self._nearest(name, base[0], self._ways[:1])[0] for name in names}

    def distances(self, name: str) -> Distances:
        """Those of each two known members, for every filter."""
        known = self._known[name]
        if name not in self._made:
            rows, added = known.difference(self._gain), np.zeros((known.case.size, 2))
            for way in np.unique(known.way):
                some = known.way == way
                rows[some], added[some] = self._ways[way].rows(rows[some])
            self._made[name] = Distances(rows, (known.difference(self._others) ** 2).sum(axis=1), added)
        return self._made[name]

    def counted(self, name: str, curve: FloatArray) -> float:
        """The smallest distance of known members for a filter as the program counts it, ndarray[n_wavelengths]; DN."""
        return self.distances(name).least(curve)

    def least_known(self, name: str, curve: FloatArray) -> float:
        """The same, as the filter comes out."""
        known = self._known[name]
        produced = np.stack([way.curve(curve) for way in self._ways])[known.way]
        apart = (known.difference(self._gain) * produced).sum(axis=1)
        return float(np.sqrt((apart**2 + (known.difference(self._others) ** 2).sum(axis=1)).min()))

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
                self._made.pop(name, None)
        return added

    def _nearest(self, name: str, curve: FloatArray, ways: Sequence[Produced] = ()) -> tuple[_Known, FloatArray]:
        """The nearest members of each two lights and part of their shifts for a filter, and their squared distances.

        For each of the first `ways` that the filter may come out, or all of them, and each place of the field.
        """
        parts = []
        for number, way in enumerate(ways or self._ways):
            response = self._seen.imager.smooth(way.curve(curve)[None, None])[0]
            for case, values in enumerate(response):
                near = self._seen.nearest(values, self._types[name], parts=self._seen.parts)
                one, other, part = np.nonzero(np.isfinite(near.squared))
                below = near.steps[one, other, part] + np.stack([near.first[one], near.second[other]], axis=1)
                share = near.shares[one, other, part]
                where = np.full(one.size, number), np.full(one.size, case)
                parts.append((*where, below, share, near.squared[one, other, part]))
        outs, cases, spectra, shares, squared = (np.concatenate(each) for each in zip(*parts, strict=True))
        return _Known(outs, cases, spectra, shares), squared
