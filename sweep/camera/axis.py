"""The smallest values along a continuous axis: sampling phase, image height, moment of a pulse, number of a series.

A pattern search from known places: from each of the best ones to the best neighbor at a finer step; then again, from
the best of all that are known, at a finer step still; at the last one as long as values fall. It finds minima near good
places; it does not prove that no lower one lies elsewhere. Designs search side by side, and each for itself: what is
needed at a place is made once, and a design knows the values of no place but its own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np

from ..base.types import Array, Bool, BoolArray, Float, IndexArray, Int

_STARTS = 2
"""Places from which each value is refined at the first step, then one."""
_ROUNDING = 1e-9
_Places = Float[Array, "places axes"]
_Values = Float[Array, "designs values places"]
At = Callable[[_Places, Bool[BoolArray, "designs places"]], _Values]
"""From places, and which of them each design asks for, to its values there; others may be anything."""


@dataclass(frozen=True)
class Axis:
    """Places of an axis, the step between those around each, and how often it is divided by `finer`.

    `period`: after which the axis begins again; without one it ends at the first and the last place.
    """

    places: _Places
    steps: Float[Array, " places"]
    rounds: int
    finer: int = 2
    period: Float[Array, " axes"] | None = None

    @classmethod
    def along(cls, places: Float[Array, " places"], rounds: int, finer: int = 2) -> Axis:
        """Return an axis of ascending places, between its ends."""
        gaps = np.diff(places, prepend=places[:1], append=places[-1:])
        return cls(places[:, None], np.maximum(gaps[:-1], gaps[1:]), rounds, finer)

    def apart(self, places: _Places, center: Float[Array, " axes"]) -> Float[Array, " places"]:
        """Return the largest distance of places along a dimension."""
        distance = np.abs(places - center)
        if self.period is not None:
            distance = np.abs(np.mod(distance + self.period / 2, self.period) - self.period / 2)
        return np.asarray(distance.max(axis=-1), dtype=float)

    def inside(self, places: Float[Array, "*batch axes"]) -> Float[Array, "*batch axes"]:
        """Return places, those beyond an end at the end."""
        return places if self.period is not None else np.clip(places, self.places[0], self.places[-1])


class Search:
    """The smallest of several values of several designs along an axis.

    `at` gives values; `known` are those at the places of the axis; `flat`: a start whose neighbors all
    differ from it by less is refined no further.
    """

    def __init__(self, axis: Axis, at: At, known: _Values, flat: Float[Array, "designs values"] | float = 0.0) -> None:
        self._axis, self._at, self._flat = axis, at, np.broadcast_to(flat, known.shape[:2])
        self.places, self.values, self._steps = axis.places, known, axis.steps
        self._number = {place: number for number, place in enumerate(map(tuple, axis.places.tolist()))}

    def run(self) -> tuple[Float[Array, "designs values"], Float[Array, "designs values axes"]]:
        """Return the smallest values and their places."""
        axis = self._axis
        shares = np.arange(1.0 - axis.finer, axis.finer) / axis.finer
        around = np.array([*product(shares, repeat=axis.places.shape[1])])
        for level in range(axis.rounds):
            share = float(axis.finer) ** -level
            centers = self._starts(1 if level else _STARTS, share)
            moving = self._varies(centers, share)
            while moving.any():
                design, value, _ = np.nonzero(moving)
                center = centers[moving]
                steps = self._steps[center]
                near = self._known(
                    self.places[center][:, None] + (steps * share)[:, None, None] * around, steps, design
                )
                there = self.values[design[:, None], value[:, None], near]
                falls = there.min(axis=1) < self.values[design, value, center]
                centers[moving] = np.where(falls, near[np.arange(center.size), there.argmin(axis=1)], center)
                moving[moving] = falls & (level == axis.rounds - 1)  # elsewhere the next step reaches as far
        return self.values.min(axis=2), self.places[self.values.argmin(axis=2)]

    def _starts(self, count: int, share: float) -> Int[IndexArray, "designs values starts"]:
        """Return the numbers of the smallest values that are more than a step apart."""
        starts = np.repeat(self.values.argmin(axis=2)[:, :, None], count, axis=2)
        left = self.values.copy()
        for number in range(1, count):
            for of in np.ndindex(*left.shape[:2]):
                left[of][self._near(int(starts[of][number - 1]), share)] = np.inf
                if np.isfinite(left[of]).any():
                    starts[of][number] = left[of].argmin()
        return starts

    def _near(self, center: int, share: float) -> Bool[BoolArray, " places"]:
        """Return which places are within a step."""
        reach = self._steps[center] * share * (1 + _ROUNDING)
        return np.asarray(self._axis.apart(self.places, self.places[center]) <= reach)

    def _varies(
        self, centers: Int[IndexArray, "designs values starts"], share: float
    ) -> Bool[BoolArray, "designs values starts"]:
        """Return whether any known neighbor of a start differs from it by more than `flat`."""
        moving = np.zeros(centers.shape, dtype=bool)
        for design, value, start in np.ndindex(*centers.shape):
            values, center = self.values[design, value], int(centers[design, value, start])
            near = values[self._near(center, share)]
            apart = np.abs(near[np.isfinite(near)] - values[center])
            moving[design, value, start] = apart.max(initial=0.0) > self._flat[design, value]
        return moving

    def _known(
        self,
        places: Float[Array, "asking around axes"],
        steps: Float[Array, " asking"],
        design: Int[IndexArray, " asking"],
    ) -> Int[IndexArray, "asking around"]:
        """Return the numbers of places, whose values the designs that ask for them know then."""
        before, flat = len(self._number), self._axis.inside(places).reshape(-1, places.shape[2])
        keys = map(tuple, flat.tolist())
        numbers = np.array([self._number.setdefault(key, len(self._number)) for key in keys])
        new, first = np.unique(numbers, return_index=True)
        first = first[new >= before]
        self.places = np.concatenate([self.places, flat[first]])
        self._steps = np.concatenate([self._steps, steps[first // places.shape[1]]])
        unknown = np.full((*self.values.shape[:2], first.size), np.inf)
        self.values = np.concatenate([self.values, unknown], axis=2)
        numbers = numbers.reshape(places.shape[:2])
        asked = np.zeros(self.values[:, 0].shape, dtype=bool)
        asked[design[:, None], numbers] = True
        asked &= ~np.isfinite(self.values[:, 0])
        which = np.flatnonzero(asked.any(axis=0))
        if which.size:
            asked = asked[:, which]
            values = self._at(self.places[which], asked)
            self.values[:, :, which] = np.where(asked[:, None], values, self.values[:, :, which])
        return numbers
