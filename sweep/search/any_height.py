"""All places of the sensor, as a limit's linear programs know them: a few image heights, and more where they bind.

A program that keeps signals apart at some places has no fewer filters than one that does so at all of them, so that
what no filter of it exceeds holds for all places, too. Its best filter says which places to add: the worst ones, found
with proof; until they are no worse than those that the program knows.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np

from ..base.types import FloatArray
from ..camera.sensor_field import SensorField
from ..camera.sensor_places import SensorPlaces
from ..metrics.quantity import DN
from ..metrics.smooth import smooth_csd
from .problem import Problem

_WITHIN_DN = 1e-3
_WORSE_DN = 0.01
"""Places that are worse than all known ones by no more than this are not added."""
_MOST_HEIGHTS = 60


class AnyHeight:
    """The problem at those image heights that are known; `whole` asks for all places of the sensor."""

    def __init__(self, whole: Problem) -> None:
        field = whole.view.scenario.field
        assert field is not None
        self._whole, self._field = whole, field
        self._heights = {*field.seen_heights, *field.knots[0]}
        asked = {*whole.objective.weights, *whole.constraints} & whole.pairs.keys()
        self._pairs = {name: whole.pairs[name] for name in sorted(asked) if whole.quantities[name].apart == DN}
        self._places = SensorPlaces(whole.view, _WITHIN_DN, Counter())

    @property
    def problem(self) -> Problem:
        """The problem at the known heights."""
        heights = tuple(sorted(self._heights))
        field = SensorField(heights=heights, cra_deg=tuple(map(self._field.cra_at, heights)))
        scene = self._whole.view.scenario.model_copy(update={"field": field})
        return replace(self._whole, view=replace(self._whole.view, scenario=scene))

    def least(self, curve: FloatArray) -> dict[str, float]:
        """No place has smaller distances for a filter, ndarray[n_wavelengths]; DN, by the name of the CSD."""
        found = self._places.worst(curve[None], tuple(self._pairs.values()))
        worst = {name: found[pair] for name, pair in self._pairs.items()}
        return {name: -np.inf if own is None else own.distance_dn - _WITHIN_DN for name, own in worst.items()}

    def more(self, curve: FloatArray) -> bool:
        """Add the worst heights for a filter; False where they are no worse than the known ones."""
        known, view = len(self._heights), self.problem.view
        for pair, worst in self._places.worst(curve[None], tuple(self._pairs.values())).items():
            if worst is None:
                continue
            if worst.distance_dn - _WITHIN_DN < smooth_csd(view, curve[None, None], pair)[0] - _WORSE_DN:
                self._heights.add(worst.height)
        return known < len(self._heights) <= _MOST_HEIGHTS
