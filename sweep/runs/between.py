"""Scenes between the scenarios of a series, and the worst value of a quantity over them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import Any

import numpy as np
from pydantic import ValidationError

from ..base.types import Array, Float, PerValue
from ..camera.axis import Axis, Search
from ..camera.scene import Scene
from ..camera.setup import Setup
from ..study import Study

STEPS = 8
"""Numbers between two neighboring scenarios at which a quantity is computed before its worst one is refined."""
_STARTS, _ROUNDS, _FINER = 4, 3, 4
"""Numbers from which the worst is refined, rounds, and how much finer each is."""
_Path = tuple[str, ...]


@dataclass(frozen=True)
class Between:
    """Scenes of a series with any number between those of its scenarios, with all effects."""

    study: Study
    setup: Setup
    scenario: str
    path: _Path

    def at(self, number: float) -> Setup:
        """Return the setup with a number; raises pydantic's ValidationError if no study may have such a scene."""
        section = _section(self.study, self.scenario)
        reduce(lambda inner, key: inner[key], self.path[:-1], section)[self.path[-1]] = number
        scene = Scene.model_validate(section)
        return replace(self.setup, scene=scene, left_out=frozenset()).with_camera(pixel=self.study.pixel_in(scene))


def between(study: Study, setup: Setup, scenarios: Mapping[str, float]) -> Between | None:
    """Return the scenes between scenarios that differ in one number alone, else None; none lies between whole ones."""
    names = list(scenarios)
    leaves = [dict(_leaves(_section(study, name))) for name in names]
    paths = {path for of in leaves for path in of if of.get(path) != leaves[0].get(path)}
    if len(paths) != 1:
        return None
    path = paths.pop()
    values = [of.get(path) for of in leaves]
    same = all(
        isinstance(value, float) and math.isclose(value, number, rel_tol=1e-9)
        for value, number in zip(values, scenarios.values(), strict=True)
    )
    return Between(study, setup, names[0], path) if same else None


def _section(study: Study, scenario: str) -> dict[str, Any]:
    section: dict[str, Any] = study.scenarios[scenario].model_dump(
        mode="json", by_alias=True, exclude_none=True, exclude={"series", "at"}
    )
    return section


def _leaves(section: Any, path: _Path = ()) -> Iterator[tuple[_Path, Any]]:
    if isinstance(section, Mapping):
        for key, inner in section.items():
            yield from _leaves(inner, (*path, key))
    else:
        yield path, section


def inner_numbers(numbers: Sequence[float], steps: int = STEPS) -> PerValue:
    """Return numbers with some between each two: of equal ratio where all are above 0, else of equal difference."""
    fine = _inner_positions(numbers, steps)
    return np.exp(fine) if min(numbers) > 0 else fine


def _inner_positions(numbers: Sequence[float], steps: int) -> PerValue:
    positions = np.log(numbers) if min(numbers) > 0 else np.array(numbers, dtype=float)
    return np.interp(np.arange((len(numbers) - 1) * (steps + 1) + 1) / (steps + 1), np.arange(len(numbers)), positions)


def minima_between(value: Callable[[float], float], numbers: Sequence[float]) -> list[tuple[float, float]]:
    """Return the lowest minima, each as the number and its value, least first: by steps between the numbers, refined.

    Values may be NaN where there is no scene.
    """

    def number(position: float) -> float:
        return float(np.exp(position)) if min(numbers) > 0 else float(position)

    def at(places: Float[Array, "places axes"], _: object = None) -> Float[Array, "designs values places"]:
        return np.nan_to_num([[[value(number(position)) for position in places[:, 0]]]], nan=np.inf)

    grid = _inner_positions(numbers, STEPS)
    known = at(grid[:, None])
    least = known[0, 0]
    lower = (least <= np.concatenate([[np.inf], least[:-1]])) & (least <= np.concatenate([least[1:], [np.inf]]))
    lower &= np.isfinite(least)
    minima = []
    for start in np.flatnonzero(lower)[np.argsort(least[lower], kind="stable")][:_STARTS]:
        around = slice(max(start - 1, 0), start + 2)
        found, place = Search(Axis.along(grid[around], _ROUNDS, _FINER), at, known[..., around]).run()
        minima.append((float(found[0, 0]), number(place[0, 0, 0])))
    return [(at_number, of_minimum) for of_minimum, at_number in sorted(minima)]


def or_nan(value: Callable[[float], float]) -> Callable[[float], float]:
    """Return a cached function that is NaN where no study may have the scene."""
    known: dict[float, float] = {}

    def cached(number: float) -> float:
        if number not in known:
            try:
                known[number] = value(number)
            except ValidationError:
                known[number] = math.nan
        return known[number]

    return cached
