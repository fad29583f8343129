"""All field positions in the linear programs of the upper bound: a few image heights, and more where they bind.

A program with constraints at some heights has no fewer filters than one with constraints at all heights, so that its
bound holds for all positions, too. Its best filter determines the heights to add: the worst ones, until they are no
worse than the known ones.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..base.types import Array, Float, PerWavelength
from ..camera.field import field_heights, setup_at
from ..camera.linear import LinearModel, linear_model
from ..camera.refine import Lattice, in_lockstep, search
from ..camera.sensor_field import SensorField
from ..metrics.places import HEIGHT_ROUNDS
from ..metrics.quantity import DN
from ..metrics.separation import separations
from ..metrics.smooth import smooth_csd
from .problem import Problem

_WORSE_DN = 0.01
"""Places that are worse than all known ones by no more than this are not added."""
_MOST_HEIGHTS = 60


class AnyHeight:
    """Problem at the known image heights."""

    def __init__(self, problem: Problem) -> None:
        field = problem.setup.scene.field
        assert field is not None
        self._whole, self._field = problem, field
        self._heights = {*field.counted_heights, *field.knots[0]}
        self._looked_at = field_heights(problem.setup)
        self._models: dict[float, LinearModel] = {}
        requested = {*problem.objective.weights, *problem.constraints} & problem.pairs.keys()
        self._pairs = {
            name: problem.pairs[name] for name in sorted(requested) if problem.quantities[name].distance_kind == DN
        }

    @property
    def problem(self) -> Problem:
        """Problem at the known heights."""
        heights = tuple(sorted(self._heights))
        field = SensorField(heights=heights, cra_deg=tuple(map(self._field.cra_at, heights)))
        scene = self._whole.setup.scene.model_copy(update={"field": field})
        return replace(self._whole, setup=replace(self._whole.setup, scene=scene))

    def _worst(self, curve: PerWavelength) -> tuple[Float[Array, " pairs"], Float[Array, " pairs"]]:
        """Return the smallest distance of each pair, DN, and its height."""
        setup = self._whole.setup

        def at_height(height: float) -> Float[Array, " pairs"]:
            if height not in self._models:
                self._models[height] = linear_model(setup_at(setup, height))
            distances = separations(self._models[height].smooth(curve[None, None])[0], setup.members)
            return np.array([distances[pair].min() for pair in self._pairs.values()])

        def at(_: list[int], places: list[Float[Array, "places axes"]]) -> list[Float[Array, "values places"]]:
            return [np.stack([at_height(height) for height in places[0][:, 0].tolist()], axis=1)]

        lattice = Lattice.along(np.array(self._looked_at), HEIGHT_ROUNDS)
        ((least, places),) = in_lockstep([search(lattice, at([0], [lattice.places])[0])], at)
        return least, places[:, 0]

    def least(self, curve: PerWavelength) -> dict[str, float]:
        """Return the smallest distances over all field positions, DN."""
        return dict(zip(self._pairs, self._worst(curve)[0].tolist(), strict=True))

    def more(self, curve: PerWavelength) -> bool:
        """Add the worst heights of a filter.

        False if they are no worse than the known ones.
        """
        known, setup = len(self._heights), self.problem.setup
        for pair, distance_dn, height in zip(self._pairs.values(), *self._worst(curve), strict=True):
            if distance_dn < smooth_csd(setup, curve[None, None], pair)[0] - _WORSE_DN:
                self._heights.add(float(height))
        return known < len(self._heights) <= _MOST_HEIGHTS
