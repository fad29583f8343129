"""Worst cases of CSDs in the linear programs of the upper bound: only those members that bind.

A filter must separate every two members of a population of lights, however production makes it, which are infinitely
many. A program that knows some of them has no fewer filters, so that its bound holds for all. Its best filter
determines the members to add: the nearest ones, found exactly, until they are no nearer than the known ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Self

import numpy as np

from ..base.types import Array, Bool, BoolArray, Float, IndexArray, Int, PerWavelength
from ..metrics.members import population_model
from ..spectra.population import Population
from .perturbed import Distances, PerturbedFilter, perturbed_filters
from .problem import Problem

_NEARER_DN = 0.01
"""Members that are nearer than all known ones by no more than this are not added."""


@dataclass(frozen=True)
class KnownPairs:
    """Pairs of lights that the programs know; every field has one row per pair."""

    def joined(self, others: Self, subset: Bool[BoolArray, " values"]) -> Self:
        """Return these and some other pairs."""
        columns = ((getattr(self, field.name), getattr(others, field.name)) for field in fields(self))
        return type(self)(*(np.concatenate([known, new[subset]]) for known, new in columns))


@dataclass(frozen=True)
class _Known(KnownPairs):
    """Known pairs of members.

    `below`: spectra below the shifts.
    """

    way: Int[IndexArray, " known"]
    case: Int[IndexArray, " known"]
    below: Int[IndexArray, "known 2"]
    share: Float[Array, "known 2"]

    def difference(self, values: Float[Array, "cases spectra channels"]) -> Float[Array, "known channels"]:
        """Return first minus second member."""
        low, high = (values[self.case[:, None], self.below + step] for step in (0, 1))
        ends = low + self.share[..., None] * (high - low)
        return np.asarray(ends[:, 0] - ends[:, 1], dtype=float)


class MemberPairs:
    """Known members of each worst case; at first the nearest ones of the base curve.

    Without a population each light is its only member.
    """

    def __init__(self, problem: Problem, names: Sequence[str]) -> None:
        setup = problem.setup
        if setup.lights.population is None:
            alone = Population.model_validate({"drift_nm_per_k": 0.0})
            setup = replace(setup, lights=replace(setup.lights, population=alone))
        self._population_model, self.names, self._ways = (
            population_model(setup),
            tuple(names),
            perturbed_filters(problem),
        )
        self._types = {name: pair for name in names if (pair := problem.quantities[name].pair) is not None}
        model, channel, base = (
            self._population_model.linear,
            problem.setup.camera.modified[0],
            problem.setup.camera.base_qe,
        )
        self._gain = model.per_qe(0, base)[:, :, channel]
        self._others = np.delete(model.smooth(base[None])[0], channel, axis=2)
        self._made: dict[str, Distances] = {}
        self._known = {name: self._nearest(name, base[0], self._ways[:1])[0] for name in names}

    def distances(self, name: str) -> Distances:
        """Return the distances of known pairs, for every filter."""
        known = self._known[name]
        if name not in self._made:
            rows, added = known.difference(self._gain), np.zeros((known.case.size, 2))
            for way in np.unique(known.way):
                of_way = known.way == way
                rows[of_way], added[of_way] = self._ways[way].rows(rows[of_way])
            self._made[name] = Distances(rows, (known.difference(self._others) ** 2).sum(axis=1), added)
        return self._made[name]

    def counted(self, name: str, curve: PerWavelength) -> float:
        """Return the smallest distance of known members as the program counts it, DN."""
        return self.distances(name).least(curve)

    def least_known(self, name: str, curve: PerWavelength) -> float:
        """Return the smallest distance of known members of the filter as produced, DN."""
        known = self._known[name]
        perturbed = np.stack([way.curve(curve) for way in self._ways])[known.way]
        differences = (known.difference(self._gain) * perturbed).sum(axis=1)
        return float(np.sqrt((differences**2 + (known.difference(self._others) ** 2).sum(axis=1)).min()))

    def least(self, name: str, curve: PerWavelength) -> float:
        """Return the smallest distance of all members, DN."""
        return float(np.sqrt(self._nearest(name, curve)[1].min()))

    def more(self, curve: PerWavelength) -> bool:
        """Add the nearest members of a filter.

        False if they are no nearer than the known ones.
        """
        added = False
        for name in self.names:
            pairs, squared = self._nearest(name, curve)
            nearer = np.sqrt(squared) < self.least_known(name, curve) - _NEARER_DN
            if nearer.any():
                added, known = True, self._known[name]
                self._known[name] = known.joined(pairs, nearer)
                self._made.pop(name, None)
        return added

    def _nearest(
        self, name: str, curve: PerWavelength, ways: Sequence[PerturbedFilter] = ()
    ) -> tuple[_Known, Float[Array, " known"]]:
        """Return the nearest members of each two lights and part of their shifts, and their squared distances."""
        parts = []
        for number, way in enumerate(ways or self._ways):
            response = self._population_model.linear.smooth(way.curve(curve)[None, None])[0]
            for case, values in enumerate(response):
                near = self._population_model.nearest(values, self._types[name], parts=self._population_model.parts)
                first_signals, second_signals, part = np.nonzero(np.isfinite(near.squared))
                below = near.steps[first_signals, second_signals, part] + np.stack(
                    [near.first[first_signals], near.second[second_signals]], axis=1
                )
                share = near.shares[first_signals, second_signals, part]
                where = np.full(first_signals.size, number), np.full(first_signals.size, case)
                parts.append((*where, below, share, near.squared[first_signals, second_signals, part]))
        outs, cases, spectra, shares, squared = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
        return _Known(outs, cases, spectra, shares), squared
