"""Smallest values over a few continuous axes, from a lattice: sampling phase, field position, moment of a pulse.

A pattern search: from each of the best known places to the best neighbor at a finer step than the lattice's; then
again, from the best of all known places, at a finer step still; at the last one as long as values fall. It finds minima
near good places; it does not prove that no lower one lies elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from ..base.types import Array, Bool, BoolArray, Float, IndexArray, Int, PerValue

_STARTS = 2
"""Places from which each value is refined at the first step, then one."""
_ROUNDING = 1e-9
_Places = Float[Array, "places axes"]
_Values = Float[Array, "values places"]
Search = Generator[_Places, _Values, tuple[PerValue, Float[Array, "values axes"]]]
"""Yields places, takes the values there, and returns the smallest values and their places."""


@dataclass(frozen=True)
class Lattice:
    """Known places, the step between those around each, and how often it is divided by `finer`.

    `period`: after which an axis begins again; `ends`: of the axes, in their place.
    """

    places: _Places
    steps: Float[Array, " places"]
    rounds: int
    finer: int = 2
    period: Float[Array, " axes"] | None = None
    ends: tuple[float, float] = (-np.inf, np.inf)

    @classmethod
    def along(cls, places: Float[Array, " places"], rounds: int, finer: int = 2) -> Lattice:
        """Return a lattice of ascending places on one axis, between its ends."""
        gaps = np.diff(places, prepend=-np.inf, append=np.inf)
        steps = np.maximum(*(np.where(np.isfinite(side), side, 0.0) for side in (gaps[:-1], gaps[1:])))
        return cls(places[:, None], steps, rounds, finer, ends=(float(places[0]), float(places[-1])))

    def apart(self, places: _Places, center: Float[Array, " axes"]) -> Float[Array, " places"]:
        """Return the largest distance of places along an axis."""
        distance = np.abs(places - center)
        if self.period is not None:
            distance = np.abs(np.mod(distance + self.period / 2, self.period) - self.period / 2)
        return np.asarray(distance.max(axis=-1), dtype=float)


class _Known:
    """Values at the places that are known."""

    def __init__(self, lattice: Lattice, values: _Values) -> None:
        self.places, self.values, self.steps = lattice.places, values, lattice.steps
        self._at = {place: at for at, place in enumerate(map(tuple, self.places.tolist()))}

    def numbers(
        self, places: _Places, steps: Float[Array, " places"]
    ) -> Generator[_Places, _Values, Int[IndexArray, " places"]]:
        """Ask for the values at places that are not known; return the numbers of all."""
        keys = list(map(tuple, places.tolist()))
        new = {key: at for at, key in enumerate(keys) if key not in self._at}
        if new:
            asked = list(new.values())
            values = yield places[asked]
            self._at |= {key: len(self.places) + number for number, key in enumerate(new)}
            self.places = np.concatenate([self.places, places[asked]])
            self.values = np.concatenate([self.values, values], axis=1)
            self.steps = np.concatenate([self.steps, steps[asked]])
        return np.array([self._at[key] for key in keys])


def search(lattice: Lattice, values: _Values, flat: PerValue | None = None) -> Search:
    """Refine the smallest values over a lattice.

    `flat`: a start whose neighbors all differ from it by less is refined no further.
    """
    flat = np.zeros(len(values)) if flat is None else flat
    known = _Known(lattice, values)
    shares = np.arange(1.0 - lattice.finer, lattice.finer) / lattice.finer
    around = np.array(list(product(shares, repeat=lattice.places.shape[1])))
    for level in range(lattice.rounds):
        share = float(lattice.finer) ** -level
        centers = _starts(lattice, known, 1 if level else _STARTS, share)
        moving = np.ones(centers.shape, dtype=bool)
        for value, start in np.ndindex(*centers.shape):
            center = centers[value, start]
            near = lattice.apart(known.places, known.places[center]) <= known.steps[center] * share * (1 + _ROUNDING)
            change = np.abs(known.values[value, near] - known.values[value, center])
            moving[value, start] = change.max() > flat[value]
        while moving.any():
            requested = np.unique(centers[moving])
            steps = known.steps[requested]
            places = known.places[requested][:, None] + (steps * share)[:, None, None] * around
            inside = ((places >= lattice.ends[0]) & (places <= lattice.ends[1])).all(axis=2)
            at = np.zeros(inside.shape, dtype=np.intp)
            at[inside] = yield from known.numbers(
                places[inside], np.repeat(steps[:, None], len(around), axis=1)[inside]
            )
            for value, start in zip(*np.nonzero(moving), strict=True):
                row = np.searchsorted(requested, centers[value, start])
                near = at[row][inside[row]]
                lowest = near[known.values[value, near].argmin()]
                falls = known.values[value, lowest] < known.values[value, centers[value, start]]
                centers[value, start] = lowest if falls else centers[value, start]
                moving[value, start] = falls and level == lattice.rounds - 1  # elsewhere the next step reaches as far
    lowest = known.values.argmin(axis=1)
    return known.values.min(axis=1), known.places[lowest]


def _starts(lattice: Lattice, known: _Known, count: int, share: float) -> Int[IndexArray, "values starts"]:
    """Return the numbers of the smallest values of each row that are more than a step apart."""
    starts = np.repeat(known.values.argmin(axis=1)[:, None], count, axis=1)
    left: Bool[BoolArray, "values places"] = np.ones(known.values.shape, dtype=bool)
    for number in range(1, count):
        for value, before in enumerate(starts[:, number - 1]):
            step = known.steps[before] * share
            left[value] &= lattice.apart(known.places, known.places[before]) > step * (1 + _ROUNDING)
            if left[value].any():
                starts[value, number] = np.where(left[value], known.values[value], np.inf).argmin()
    return starts


def in_lockstep(
    searches: Sequence[Search], evaluate: Callable[[list[int], list[_Places]], list[_Values]]
) -> list[tuple[PerValue, Float[Array, "values axes"]]]:
    """Run searches of several designs side by side: what all of them ask for is evaluated together.

    `evaluate`: from the numbers of the searches that ask, and their places, to the values there.
    """
    results: dict[int, tuple[PerValue, Float[Array, "values axes"]]] = {}
    answers: dict[int, _Values | None] = dict.fromkeys(range(len(searches)))
    while answers:
        asked = {}
        for number, values in answers.items():
            try:
                asked[number] = searches[number].send(values) if values is not None else next(searches[number])
            except StopIteration as end:
                results[number] = end.value
        answers = dict(zip(asked, evaluate(list(asked), list(asked.values())), strict=True)) if asked else {}
    return [results[number] for number in range(len(searches))]
