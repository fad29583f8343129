"""Usable range of designs: the number between two scenarios at which the state error is the allowed one."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial, reduce
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import pyarrow as pa
from pydantic import ValidationError

from ..base.types import FloatArray, Parallel, Progress, delayed
from ..camera.forward import ForwardModel
from ..camera.scene import Scene
from ..camera.setup import Setup
from ..metrics.columns.confusion import STATE_ERROR, state_errors
from ..results.designs import few_rows, row_curves
from ..study import Study
from ..study.axes import series_of
from .workers import run_with_progress

if TYPE_CHECKING:
    import pandas as pd

_LEAST = 1e-300
_CLOSE = 1e-3
"""Relative tolerance of the number."""
_SCHEMA = pa.schema(
    [("design_id", pa.int64())]
    + [(name, pa.string()) for name in ("name", "series", "key")]
    + [(name, pa.float64()) for name in ("low", "high", "at", "error")]
)
_Path = tuple[str, ...]
"""Keys to a number of a scene."""


def crossings_table(study: Study, rows: pd.DataFrame, parallel: Parallel, progress: Progress) -> pa.Table:
    """Find where the error of designs passes the allowed one, with all effects.

    One row per series of scenarios (`series`, `key`) and design whose error passes the limit once: `low` and `high`
    are the numbers of the two scenarios, `at` is the crossing, `error` the error there; `design_id` is that of the row
    at `low`.

    Parameters
    ----------
    study : Study
        Study of the run.
    rows : pandas.DataFrame
        Rows of plain CFAs, named designs and the answer.
    parallel : callable
        Runs calls on the cores.
    progress : callable
        Called with a phase, work done and work in total.

    Returns
    -------
    pyarrow.Table
        Table.
    """
    recognition = study.section.recognition
    assert recognition is not None
    few, allowed = few_rows(rows), recognition.error_max
    made: list[dict[str, Any]] = []
    calls = []
    for (series, key), scenarios in series_of(study.scenarios).items():
        for row, ends, errors in _passing(few, scenarios, allowed):
            numbers = (scenarios[ends[0]], scenarios[ends[1]])
            path = _differing(study, ends, numbers)
            if path is not None:
                space, curves = row_curves(study, row)
                between = partial(setup_between, study, study.setup(space, ends[0]), ends[0], path)
                calls.append(delayed(_crossing, between, curves, study.states, numbers, errors, allowed))
                design = {"design_id": row["design_id"], "name": row["name"], "series": series, "key": key}
                made.append(design | {"low": numbers[0], "high": numbers[1]})
    answers = run_with_progress(parallel, calls, "where designs stop being usable", progress)
    return pa.Table.from_pylist([row | at for row, at in zip(made, answers, strict=True)], schema=_SCHEMA)


def _passing(
    few: Sequence[Mapping[Any, Any]], scenarios: Mapping[str, float], allowed: float
) -> Iterator[tuple[Mapping[Any, Any], tuple[str, str], tuple[float, float]]]:
    """Yield designs whose error passes the allowed one once: the row before, both scenarios, and their errors."""
    designs: dict[str, dict[str, Mapping[Any, Any]]] = {}
    for row in few:
        if row["scenario"] in scenarios:
            designs.setdefault(row["name"], {})[row["scenario"]] = row
    for by_scene in designs.values():
        if by_scene.keys() != scenarios.keys():
            continue
        errors = {name: float(by_scene[name][STATE_ERROR]) for name in scenarios}
        turns = [(a, b) for a, b in pairwise(scenarios) if (errors[a] <= allowed) != (errors[b] <= allowed)]
        if len(turns) == 1:
            a, b = turns[0]
            yield by_scene[a], (a, b), (errors[a], errors[b])


def _differing(study: Study, ends: tuple[str, str], numbers: tuple[float, float]) -> _Path | None:
    """Return the only number in which two scenarios differ, if it is the one in their names, else None."""
    one, other = (dict(_leaves(_section(study, name))) for name in ends)
    paths = [path for path in {**one, **other} if one.get(path) != other.get(path)]
    values = [leaves.get(path) for path in paths for leaves in (one, other)]
    if len(paths) == 1 and all(
        isinstance(value, int | float) and math.isclose(value, number, rel_tol=1e-9)
        for value, number in zip(values, numbers, strict=True)
    ):
        return paths[0]
    return None


def _section(study: Study, scenario: str) -> dict[str, Any]:
    section: dict[str, Any] = study.scenarios[scenario].model_dump(mode="json", by_alias=True, exclude_none=True)
    return section


def _leaves(section: Any, path: _Path = ()) -> Iterator[tuple[_Path, Any]]:
    if isinstance(section, Mapping):
        for key, inner in section.items():
            yield from _leaves(inner, (*path, key))
    else:
        yield path, section


def setup_between(study: Study, setup: Setup, scenario: str, path: _Path, number: float) -> Setup:
    """Return the setup of a scenario with another number and all effects.

    Parameters
    ----------
    study : Study
        Study of the run.
    setup : Setup
        Scene and camera.
    scenario : str
        Scenario.
    path : tuple
        Key of the number.
    number : float
        Its value.

    Returns
    -------
    Setup
        Setup.

    Raises
    ------
    ValidationError
        If no study may have such a scene.
    """
    section = _section(study, scenario)
    reduce(lambda inner, key: inner[key], path[:-1], section)[path[-1]] = number
    scene = Scene.model_validate(section)
    return replace(setup, scene=scene, left_out=frozenset()).with_camera(pixel=study.pixel_in(scene))


def state_error_of(setup: Setup, curves: FloatArray, states: tuple[str, ...]) -> float:
    """Return the error of the worst pair of states.

    Parameters
    ----------
    setup : Setup
        Scene and camera.
    curves : ndarray of shape (1, n_modified, n_wavelengths)
        QE of the modified channels.
    states : tuple of str
        Signal types.

    Returns
    -------
    float
        Error probability.
    """
    return float(state_errors(ForwardModel(setup, once=True), curves, states)[0])


def _crossing(
    between: Callable[[float], Setup],
    curves: FloatArray,
    states: tuple[str, ...],
    ends: tuple[float, float],
    errors: tuple[float, float],
    allowed: float,
) -> dict[str, float]:
    """Return the number with the allowed error, and the error there; empty if no scene in between exists.

    The logarithms of both numbers are nearly on a line.
    """
    from scipy.optimize import brentq  # noqa: PLC0415  (few studies ask for it)

    by_ratio = min(ends) > 0
    positions = tuple(math.log(end) if by_ratio else end for end in ends)
    known = dict(zip(positions, errors, strict=True))

    def number_at(position: float) -> float:
        return math.exp(position) if by_ratio else position

    def error_at(position: float) -> float:
        if position not in known:
            known[position] = state_error_of(between(number_at(position)), curves, states)
        return known[position]

    def decades(position: float) -> float:
        return math.log10(max(error_at(position), _LEAST) / allowed)

    try:
        position = brentq(decades, *positions, xtol=_CLOSE * (1.0 if by_ratio else abs(ends[1] - ends[0])))
        return {"at": number_at(position), "error": error_at(position)}
    except ValidationError:
        return {}
