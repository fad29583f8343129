"""Up to where designs are usable: the number between two scenarios at which the error of states is what is allowed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
from pydantic import ValidationError

from ..base.types import FloatArray, Parallel, Progress, delayed
from ..camera.forward import ForwardModel
from ..camera.scene import Scene
from ..camera.setup import Setup
from ..metrics.columns.confusion import STATE_ERROR, state_errors
from ..results.designs import row_curves
from ..results.tables import FEW
from ..study import Study
from ..study.axes import series_of

if TYPE_CHECKING:
    import pandas as pd

_LEAST = 1e-300
_CLOSE = 1e-3
"""The number is found so closely, relative."""
_FIELDS = [
    ("design_id", pa.int64()),
    *((name, pa.string()) for name in ("name", "series", "key")),
    *((name, pa.float64()) for name in ("low", "high", "at", "error")),
]


@dataclass(frozen=True)
class ScenesBetween:
    """Scenes of a study between two that differ in one number: the keys to it, and what all of them say.

    `setup`: of the lower one, as a CFA sees it.
    """

    setup: Setup
    study: Study
    said: Mapping[str, Any]
    path: tuple[str, ...]

    def at(self, number: float) -> Setup:
        """The scene with another number, everything on. Raises ValidationError where a study may not have it."""
        said = _with(self.said, self.path, number)
        scene = Scene.model_validate(said)
        return replace(self.setup, scene=scene, left_out=frozenset()).with_camera(pixel=self.study.pixel_in(scene))


def crossings_table(study: Study, rows: pd.DataFrame, parallel: Parallel, progress: Progress) -> pa.Table:
    """A row per series of scenarios and plain CFA, named design or answer whose error passes what is allowed once.

    `series`, `key`: of scenarios that differ in one number; `low`, `high`: the numbers of the two between which it
    passes, `at`: where, with everything on, and the `error` there. `design_id`: of the row at `low`.
    """
    asked = study.section.recognition
    assert asked is not None
    few = rows[rows["kind"].isin(FEW) & (rows["status"] == "ok")]
    found: list[dict[str, Any]] = []
    calls = []
    for (series, key), scenarios in series_of(study.scenarios).items():
        for row, ends, errors in _passing(few, scenarios, asked.error_max):
            space, curves = row_curves(study, row)
            numbers = (scenarios[ends[0]], scenarios[ends[1]])
            between = _between(study, study.setup(space, ends[0]), ends, numbers)
            if between is not None:
                calls.append(delayed(_crossing, between, curves, study.states, numbers, errors, asked.error_max))
                own = {"design_id": row["design_id"], "name": row["name"], "series": series, "key": key}
                found.append(own | {"low": numbers[0], "high": numbers[1]})
    for number, (row, values) in enumerate(zip(found, parallel(iter(calls)), strict=True), 1):
        row.update(values)
        progress("where designs stop being usable", number, len(found))
    return pa.Table.from_pylist(found, schema=pa.schema(_FIELDS))


def _passing(
    few: pd.DataFrame, scenarios: Mapping[str, float], allowed: float
) -> Iterator[tuple[dict[Any, Any], tuple[str, str], tuple[float, float]]]:
    """Designs whose error passes what is allowed once: the row before, both scenarios, and the errors in them."""
    for _, own in few[few["scenario"].isin(list(scenarios))].groupby("name", observed=True, sort=False):
        by_scene = {str(row["scenario"]): row for row in own.to_dict("records")}
        if by_scene.keys() != scenarios.keys():
            continue
        errors = {name: float(by_scene[name][STATE_ERROR]) for name in scenarios}
        turns = [(a, b) for a, b in pairwise(scenarios) if (errors[a] <= allowed) != (errors[b] <= allowed)]
        if len(turns) == 1:
            a, b = turns[0]
            yield by_scene[a], (a, b), (errors[a], errors[b])


def _between(study: Study, setup: Setup, ends: tuple[str, str], numbers: tuple[float, float]) -> ScenesBetween | None:
    """The scenes between two of a study, seen as `setup` sees the first.

    None where more than a number differs, or this number is not the one in their names (`numbers`).
    """
    first, second = (study.scenarios[name].model_dump(mode="json", by_alias=True, exclude_none=True) for name in ends)
    one, other = dict(_leaves(first)), dict(_leaves(second))
    paths = [path for path in {**one, **other} if one.get(path) != other.get(path)]
    if len(paths) != 1:
        return None
    values = [leaves.get(paths[0]) for leaves in (one, other)]
    if not all(
        isinstance(value, int | float) and math.isclose(value, number, rel_tol=1e-9)
        for value, number in zip(values, numbers, strict=True)
    ):
        return None
    return ScenesBetween(setup, study, first, paths[0])


def _leaves(said: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    if isinstance(said, Mapping):
        for key, inner in said.items():
            yield from _leaves(inner, (*path, key))
    else:
        yield path, said


def _with(said: Mapping[str, Any], path: tuple[str, ...], number: float) -> dict[str, Any]:
    inner = number if len(path) == 1 else _with(said[path[0]], path[1:], number)
    return {**said, path[0]: inner}


def state_error_of(setup: Setup, curves: FloatArray, states: tuple[str, ...]) -> float:
    """How often noise confuses the worst two states of a filter; `curves`: ndarray[1, n_modified, n_wavelengths]."""
    return float(state_errors(ForwardModel(setup, once=True), curves, states)[0])


def _crossing(
    between: ScenesBetween,
    curves: FloatArray,
    states: tuple[str, ...],
    ends: tuple[float, float],
    errors: tuple[float, float],
    allowed: float,
) -> dict[str, float]:
    """Where the error is what is allowed, and what it is there; nothing where no scene between the two can be had.

    The logarithms of both numbers are nearly on a line; `errors`: at the ends, as the run has them.
    """
    from scipy.optimize import brentq  # noqa: PLC0415  (few studies ask for it)

    by_ratio = min(ends) > 0
    places = tuple(float(np.log(end)) if by_ratio else end for end in ends)
    known = dict(zip(places, errors, strict=True))

    def error_at(place: float) -> float:
        if place not in known:
            number = float(np.exp(place)) if by_ratio else place
            known[place] = state_error_of(between.at(number), curves, states)
        return known[place]

    def decades(place: float) -> float:
        return float(np.log10(max(error_at(place), _LEAST) / allowed))

    try:
        place = brentq(decades, *places, xtol=_CLOSE * (1.0 if by_ratio else abs(ends[1] - ends[0])))
        return {"at": float(np.exp(place)) if by_ratio else float(place), "error": error_at(place)}
    except ValidationError:
        return {}
