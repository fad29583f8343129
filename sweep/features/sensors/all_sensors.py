"""One filter for several sensors, and a filter for all but one, judged on that one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import pyarrow as pa

from ...base.types import Parallel, Progress, delayed
from ...designs.family import ChoosingFamily, Family
from ...metrics.bound import FEASIBLE
from ...runs.workers import run_with_progress
from ...search.problem import Evaluation, Problem, best_feasible, starting_points
from ...search.solver import search_from, smooth_evaluation
from ...study import Search, SensorAndLights, Study

ALL = "all sensors"
_STARTS = 8
_MOST_LEFT_OUT = 12
"""Sensors that are left out in turn; of more there is one filter for all."""
_SCHEMA = pa.schema(
    [(name, pa.string()) for name in ("designed_on", "space", "sensor", "lights")]
    + [("judged", pa.bool_())]
    + [(name, pa.float64()) for name in ("objective", "sensitivity", "cfa_sensitivity", "own_best", "violation")]
    + [("parameters", pa.string())]
)


def all_sensors_table(
    studies: Sequence[tuple[SensorAndLights, Study]], parallel: Parallel, progress: Progress
) -> pa.Table | None:
    """Search one filter for all sensors that have the searched space, and one for all but each of a few in turn.

    Each filter has the largest worst objective over the sensors and lights that it is designed on, under the
    constraints on each of them. One row per filter and sensor with lights: `designed_on` (all sensors, or all but one),
    `judged` (whether it was not designed on this one), objective and sensitivities there before clipping and rounding,
    the `violation` of the constraints, and `own_best`, the objective of the best filter found for this one alone.

    None if there is none.
    """
    by_space: dict[str, list[tuple[SensorAndLights, Problem, Search]]] = {}
    for member, study in studies:
        # A choice from a catalog is a search of its own, and is not made for several sensors.
        if (search := study.search) is not None and not isinstance(_family_of(search), ChoosingFamily):
            by_space.setdefault(search.space.name, []).append((member, study.problem(search), search))
    rows: list[dict[str, Any]] = []
    for space, searched in by_space.items():
        sensors = list(dict.fromkeys(member.sensor for member, _, _ in searched))
        if len(sensors) > 1:
            rows += _of_space(space, searched, sensors, parallel, progress)
    return pa.Table.from_pylist(rows, schema=_SCHEMA) if rows else None


def _family_of(search: Search) -> Family:
    assert search.space.filter is not None
    return search.space.filter.family


def _of_space(
    space: str,
    searched: Sequence[tuple[SensorAndLights, Problem, Search]],
    sensors: Sequence[str],
    parallel: Parallel,
    progress: Progress,
) -> Iterator[dict[str, Any]]:
    """Yield the rows of one space."""
    members = [member for member, _, _ in searched]
    problems, search = [problem for _, problem, _ in searched], searched[0][2]
    parts: dict[str, list[int]] = {ALL: [*range(len(members))]}
    left_out = sensors if len(sensors) <= _MOST_LEFT_OUT else ()
    parts |= {f"all but {sensor}": [at for at, m in enumerate(members) if m.sensor != sensor] for sensor in left_out}
    alone = {f"{at}": [at] for at in range(len(members))}
    calls, of_call = [], []
    for name, numbers in (parts | alone).items():
        joined = _joined([problems[at] for at in numbers])
        for start, u in enumerate(starting_points(joined, min(search.starts, _STARTS), joined.seed)):
            effort = search.algorithm, max(10, search.max_evaluations // search.starts)
            calls.append(delayed(search_from, joined, start, u, *effort, joined.seed))
            of_call.append(name)
    logs: dict[str, list[Evaluation]] = {}
    for name, run in zip(
        of_call, run_with_progress(parallel, calls, "filters for several sensors", progress), strict=True
    ):
        logs.setdefault(name, []).extend(run.log)
    best = {name: best_feasible(log) for name, log in logs.items()}
    for name, numbers in parts.items():
        design = best[name]
        if design is None:
            continue
        for at, member in enumerate(members):
            here = smooth_evaluation(problems[at], design.x)
            alone_best = best[f"{at}"]
            parameters = zip(search.space.parameters, design.x, strict=True)
            yield {
                "designed_on": name,
                "space": space,
                "sensor": member.sensor,
                "lights": member.lights,
                "judged": at not in numbers,
                "objective": here.objective,
                "sensitivity": here.sensitivity,
                "cfa_sensitivity": here.cfa_sensitivity,
                "violation": here.violation if here.violation > FEASIBLE else 0.0,
                "own_best": None if alone_best is None else alone_best.objective,
                "parameters": ", ".join(f"{key} {value:.2f}" for key, value in parameters),
            }


def _joined(problems: Sequence[Problem]) -> Problem:
    """Return the problem of the worst of several sensors."""
    scenes = [scene for problem in problems for scene in problem.scenes]
    return replace(problems[0], others=tuple(scenes[1:]))
