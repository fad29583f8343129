"""Cutting planes of the upper bound: of infinitely many distances, those that a filter near the bound falls short of.

A filter must separate every two members of a population of lights, at every brightness of a lamp and every field
position, however production makes it. A program that knows some of these distances has no fewer filters, so that its
bound holds for all. Its best filter determines those to add: the nearest, until they are no nearer than the known ones.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np

from ..base.types import Array, Bool, BoolArray, Float, PerChannel, PerWavelength
from ..camera.axis import Axis, Search
from ..camera.field import field_heights, setup_at
from ..camera.linear import LinearModel, linear_model
from ..metrics.members import population_model
from ..metrics.places import HEIGHT_ROUNDS
from ..metrics.quantity import DN
from ..metrics.separation import separations
from ..spectra.population import Population
from .perturbed import Distances, perturbed_filters
from .problem import Problem

Nearest = tuple[Distances, Float[Array, " distances"]]
"""Distances of pairs of lights for every filter, and what they are for one, DN."""


class Source(ABC):
    """Distances of one kind: `names` of the quantities, and by how much less counts as nearer, DN."""

    nearer_dn: float
    names: tuple[str, ...]

    @abstractmethod
    def __init__(self, problem: Problem, names: Sequence[str]) -> None:
        """Compute what every filter shares."""

    @abstractmethod
    def first(self, name: str, base: PerWavelength) -> Distances:
        """Return the distances to begin with."""

    @abstractmethod
    def nearest(self, name: str, curve: PerWavelength) -> Nearest:
        """Return the pairs that a filter brings nearest."""


class Members(Source):
    """Worst cases of CSDs over a population, and production; without a population each light is its only member."""

    nearer_dn = 0.01

    def __init__(self, problem: Problem, names: Sequence[str]) -> None:
        setup, base = problem.setup, problem.setup.camera.base_qe
        if setup.lights.population is None:
            alone = Population.model_validate({"drift_nm_per_k": 0.0})
            setup = replace(setup, lights=replace(setup.lights, population=alone))
        self._model, self.names, self._ways = population_model(setup), tuple(names), perturbed_filters(problem)
        self._types = {name: pair for name in names if (pair := problem.quantities[name].pair) is not None}
        self._gain, self._others = _linear(self._model.linear, base)

    def first(self, name: str, base: PerWavelength) -> Distances:
        return self._of_ways(name, base, 1)[0]

    def nearest(self, name: str, curve: PerWavelength) -> Nearest:
        return self._of_ways(name, curve, len(self._ways))

    def _of_ways(self, name: str, curve: PerWavelength, n_ways: int) -> Nearest:
        """Return the nearest members of each two lights and part of their shifts, in each of the first ways."""
        distances, lengths = [], []
        for way in self._ways[:n_ways]:
            response = self._model.linear.smooth(way.curve(curve)[None, None])[0]
            for case, values in enumerate(response):
                near = self._model.nearest(values, self._types[name], parts=self._model.parts)
                which = np.isfinite(near.squared)
                both = self._gain[case], self._others[case]
                gain, others = (near.of(of, 0)[which] - near.of(of, 1)[which] for of in both)
                distances.append(replace(way.distances(gain), squared=(others**2).sum(axis=1)))
                lengths.append(np.sqrt(near.squared[which]))
        return _joined(distances), np.concatenate(lengths)


class Brightnesses(Source):
    """Chromatic distances of lamps of any brightness.

    The chromatic distance of two signals is min over a in [0, 1] of |y1 - a y2| and |a y1 - y2|. For any fixed
    brightness the difference is linear in the filter, and no chromatic distance exceeds it.
    """

    nearer_dn = 0.001

    def __init__(self, problem: Problem, names: Sequence[str]) -> None:
        setup, base = problem.setup, problem.setup.camera.base_qe
        self.names, self._members = tuple(names), setup.members
        self._types = {name: problem.pairs[name] for name in names}
        self._linear = {
            name: _linear(
                linear_model(setup), base, problem.quantities[name].factors(setup.camera.mosaic), lamps_only=True
            )
            for name in names
        }

    def first(self, name: str, base: PerWavelength) -> Distances:
        return self.nearest(name, base)[0]

    def nearest(self, name: str, curve: PerWavelength) -> Nearest:
        """Return every pair at its worst brightness."""
        first, second = (self._members[kind] for kind in self._types[name])
        own_gain, own_others = self._linear[name]
        case, one, other = (at.ravel() for at in np.meshgrid(range(len(own_gain)), first, second, indexing="ij"))
        response = np.concatenate([own_others, (own_gain @ curve)[:, :, None]], axis=2)
        a, b = response[case, one], response[case, other]
        squares, product = np.stack([(a * a).sum(axis=1), (b * b).sum(axis=1)]), (a * b).sum(axis=1)
        brighter = squares.argmax(axis=0)  # the brighter signal is dimmed
        larger = squares.max(axis=0)
        factors = np.ones((case.size, 2))
        ratio = np.divide(product, larger, out=np.zeros_like(product), where=larger > 0)
        factors[np.arange(case.size), brighter] = np.clip(ratio, 0.0, 1.0)
        gain, others, whole = (
            factors[:, :1] * values[case, one] - factors[:, 1:] * values[case, other]
            for values in (own_gain, own_others, response)
        )
        return Distances.of(gain, (others**2).sum(axis=1)), np.sqrt((whole**2).sum(axis=1))


class Heights(Source):
    """CSDs over all field positions: a few image heights, and more where they bind."""

    nearer_dn = 0.01

    def __init__(self, problem: Problem, names: Sequence[str]) -> None:
        self._setup, field = problem.setup, problem.setup.scene.field
        assert field is not None
        self.names, self._types = tuple(names), {name: problem.pairs[name] for name in names}
        self._first = sorted({*field.counted_heights, *field.knots[0]})
        self._looked_at = field_heights(self._setup)
        self._factors = {name: problem.quantities[name].factors(self._setup.camera.mosaic) for name in names}
        self._models: dict[float, LinearModel] = {}

    def _at(self, height: float) -> LinearModel:
        if height not in self._models:
            self._models[height] = linear_model(setup_at(self._setup, height))
        return self._models[height]

    def _distances(self, name: str, height: float) -> Distances:
        """Return the distances of each two signals at a height."""
        gain, others = _linear(self._at(height), self._setup.camera.base_qe, self._factors[name])
        first, second = (self._setup.members[kind] for kind in self._types[name])
        rows = gain[:, first, None] - gain[:, None, second]
        squared = ((others[:, first, None] - others[:, None, second]) ** 2).sum(axis=-1)
        return Distances.of(rows.reshape(-1, rows.shape[-1]), squared.ravel())

    def first(self, name: str, base: PerWavelength) -> Distances:  # noqa: ARG002
        return _joined([self._distances(name, height) for height in self._first])

    def nearest(self, name: str, curve: PerWavelength) -> Nearest:
        """Return each two signals at the height at which two of them are nearest."""

        def at(heights: Float[Array, "places 1"], _: Bool[BoolArray, "1 places"]) -> Float[Array, "1 1 places"]:
            factors = self._factors[name]
            responses = [self._at(at).smooth(curve[None, None])[0] * factors for at in heights[:, 0].tolist()]
            return np.array([[[separations(each, self._setup.members)[self._types[name]].min() for each in responses]]])

        axis = Axis.along(np.array(self._looked_at), HEIGHT_ROUNDS)
        known = at(axis.places, np.ones((1, len(axis.places)), dtype=bool))
        _, places = Search(axis, at, known).run()
        distances = self._distances(name, float(places[0, 0, 0]))
        return distances, distances.produced(curve)


def _linear(
    model: LinearModel,
    base: Float[Array, "1 wavelengths"],
    factors: PerChannel | float = 1.0,
    *,
    lamps_only: bool = False,
) -> tuple[Float[Array, "cases spectra wavelengths"], Float[Array, "cases spectra others"]]:
    """Return the response per unit of QE of the modified channel, and that of the other channels.

    `factors`: of the channels' readings.
    """
    channel = model.setup.camera.modified[0]
    response = model.smooth(base[None])[0] - (model.unlit(base[None])[0][:, None] if lamps_only else 0.0)
    gain = np.swapaxes(model.per_qe(0, base, lamps_only=lamps_only), 2, 3) * factors
    return gain[..., channel], np.delete(response * factors, channel, axis=2)


def _joined(parts: Sequence[Distances]) -> Distances:
    columns = ([getattr(part, field.name) for part in parts] for field in fields(Distances))
    return Distances(*map(np.concatenate, columns))


class Pool:
    """Known distances of every quantity that has infinitely many."""

    def __init__(self, problem: Problem) -> None:
        names = dict.fromkeys((*problem.objective.weights, *problem.constraints))
        kinds = {name: problem.quantities[name].distance_kind for name in names}
        nominal = problem.pairs.keys() if problem.setup.all_heights else ()
        of_kind: tuple[tuple[type[Source], list[str]], ...] = (
            (Members, [name for name in names if problem.worst_distance(name)]),
            (Brightnesses, [name for name in names if kinds[name] == "chromatic"]),
            (Heights, [name for name in names if name in nominal and kinds[name] == DN]),
        )
        sources = [make(problem, own) for make, own in of_kind if own]
        self._sources = {name: source for source in sources for name in source.names}
        base = problem.setup.camera.base_qe[0]
        self._known = {name: source.first(name, base) for name, source in self._sources.items()}

    @property
    def names(self) -> tuple[str, ...]:
        """Quantities that have infinitely many distances."""
        return tuple(self._sources)

    def distances(self, name: str) -> Distances:
        """Return the known distances of a quantity, for every filter."""
        return self._known[name]

    def counted(self, curve: PerWavelength) -> dict[str, float]:
        """Return the smallest known distances of a filter as the program counts them, DN."""
        return {name: known.least(curve) for name, known in self._known.items()}

    def least(self, curve: PerWavelength) -> dict[str, float]:
        """Return the smallest of all distances of a filter, DN."""
        return {name: float(source.nearest(name, curve)[1].min()) for name, source in self._sources.items()}

    def more(self, curve: PerWavelength) -> bool:
        """Add what a filter brings nearer than all that is known; return whether there is any."""
        added = False
        for name, source in self._sources.items():
            distances, length_dn = source.nearest(name, curve)
            nearer = length_dn < self._known[name].produced(curve).min() - source.nearer_dn
            if nearer.any():
                added, self._known[name] = True, _joined([self._known[name], distances.subset(nearer)])
        return added
