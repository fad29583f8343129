"""Separations on each light that a search leaves out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import pyarrow as pa

from ...base.types import Array, Float, delayed
from ...metrics.objective import Objective
from ...metrics.quantity import WORST_CASE
from ...runs.analysis import RunTable, Shown
from ...runs.workers import run_with_progress
from ...search.problem import Problem, best_feasible, starting_points
from ...search.solver import search_from, smooth_objective
from ...study import Search, Study
from . import LEFT_OUT
from .section import leaves_one_out

_LEFT_OUT_STARTS = 4
"""Starts of each search without a light."""
_NAMES = ("objective", "signal_type", "signal")
_FIGURES = ("seen", "with_it", "fall")


def _table(shown: Shown) -> pa.Table:
    """Search without each light of the objective in turn.

    Each search starts from the study's answer and a few other points. For a worst case the nominal quantity is
    searched, too. A light that is alone in its type cannot be left out.

    `seen`: optimum without the light, `with_it`: the same design with all lights, `fall`: the difference. All are
    before clipping and quantization.
    """
    study, search = shown.study, shown.study.search
    assert search is not None
    problem, seed, lights = study.problem(search), study.section.seed, study.lights
    parallel = shown.kept("left out")
    points = starting_points(problem, _LEFT_OUT_STARTS - 1, seed)
    budget = (search.algorithm, _evaluations_of_start(search), seed)
    optima = [(problem, shown.answer)]
    if _has_nominal(problem):
        of = problem.quantities[problem.objective.column].of
        nominal = replace(problem, objective=Objective(minimum={of: 1.0}))
        starts = [problem.to_unit(shown.answer), *points]
        calls = [delayed(search_from, nominal, i, start, *budget) for i, start in enumerate(starts)]
        best = best_feasible([e for run in parallel(calls) for e in run.log])
        optima += [] if best is None else [(nominal, best.x)]
    calls, rows = [], []
    for requested, optimum in optima:
        starts = [requested.to_unit(optimum), *points]
        for at in _left_out_signals(requested):
            calls.append(delayed(_without, requested, at, starts, *budget))
            rows.append(
                dict(zip(_NAMES, (requested.objective.column, lights.types[at], lights.names[at]), strict=True))
            )
    answers = run_with_progress(parallel, calls, "lights left out", shown.progress)
    figures = [dict(zip(_FIGURES, answer or (None,) * 3, strict=True)) for answer in answers]
    schema = pa.schema([*((name, pa.string()) for name in _NAMES), *((name, pa.float64()) for name in _FIGURES)])
    return pa.Table.from_pylist([row | values for row, values in zip(rows, figures, strict=True)], schema=schema)


def planned(study: Study) -> Iterator[str]:
    """Yield what is to do, for a run that is only planned."""
    if leaves_one_out(study):
        yield f"Without one light after the other: {most_evaluations(study):,} evaluations at most."


def most_evaluations(study: Study) -> int:
    """Return the largest number of evaluations of all searches without a light."""
    assert study.search is not None
    problem = study.problem(study.search)
    optima = 2 if _has_nominal(problem) else 1
    searches = optima * len(_left_out_signals(problem)) + optima - 1
    return searches * _LEFT_OUT_STARTS * _evaluations_of_start(study.search)


def _evaluations_of_start(search: Search) -> int:
    return max(1, search.max_evaluations // _LEFT_OUT_STARTS)


def _has_nominal(problem: Problem) -> bool:
    """Return whether the objective is a single worst case."""
    quantity = problem.quantities.get(problem.objective.column)
    return quantity is not None and quantity.extreme == WORST_CASE


def _left_out_signals(problem: Problem) -> list[int]:
    """Return the lights of the objective's types that are not alone in their type."""
    lights, kinds = problem.setup.lights, set[str]()
    for column in problem.objective.weights:
        quantity = problem.quantities[column]
        if quantity.needs == "own":  # it may be of any type
            kinds.update(lights.classes)
        else:
            kinds.update(quantity.states if quantity.pair is None else quantity.pair)
    return [i for i, kind in enumerate(lights.types) if kind in kinds and lights.types.count(kind) > 1]


def _without(
    problem: Problem,
    light: int,
    starts: Sequence[Float[Array, "starts free"]],
    algorithm: str,
    evaluations: int,
    seed: int,
) -> tuple[float, float, float] | None:
    """Return the objective of the optimum without a light: without it, with it, and their difference."""
    lights = problem.setup.lights
    remaining = [i for i in range(len(lights.names)) if i != light]
    fewer_lights = replace(
        lights,
        names=tuple(lights.names[i] for i in remaining),
        types=tuple(lights.types[i] for i in remaining),
        photons=lights.photons[remaining],
    )
    (setup, _), *others = (
        (replace(setup_of_scene, lights=fewer_lights), family) for setup_of_scene, family in problem.scenes
    )
    fewer = replace(problem, setup=setup, others=tuple(others))
    log = [e for i, start in enumerate(starts) for e in search_from(fewer, i, start, algorithm, evaluations, seed).log]
    best = best_feasible(log)
    if best is None:
        return None
    with_light = smooth_objective(problem, best.x)
    return best.objective, with_light, best.objective - with_light


TABLES = (RunTable(LEFT_OUT, leaves_one_out, _table),)
