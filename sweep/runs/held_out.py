"""Separations on each light that a search leaves out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import pyarrow as pa

from ..base.types import Array, Float, Parallel, Progress, delayed
from ..metrics.objective import Objective
from ..metrics.quantity import WORST_CASE
from ..search.problem import Evaluation, Problem, best_feasible, starting_points
from ..search.solver import search_from, smooth_objective
from ..study import Search, Study
from .workers import run_with_progress

if TYPE_CHECKING:
    pass

_LEFT_OUT_STARTS = 4
"""Starts of each search without a light."""
_NAMES = ("objective", "signal_type", "signal")
_FIGURES = ("seen", "with_it", "fall")


def left_out_table(study: Study, search: Search, best: Evaluation, parallel: Parallel, progress: Progress) -> pa.Table:
    """Search without each light of the objective in turn.

    Each search starts from the study's answer and a few other points. For a worst case the nominal quantity is
    searched, too. A light that is alone in its type cannot be left out.

    `seen`: optimum without the light, `with_it`: the same design with all lights, `fall`: the difference. All are
    before clipping and quantization.
    """
    problem, seed, lights = study.problem(search), study.section.seed, study.lights
    points = starting_points(problem, _LEFT_OUT_STARTS - 1, seed)
    budget = (search.algorithm, _evaluations_of_start(search), seed)
    optima = [(problem, best)]
    if _has_nominal(problem):
        of = problem.quantities[problem.objective.column].of
        nominal = replace(problem, objective=Objective(minimum={of: 1.0}))
        starts = [problem.to_unit(best.x), *points]
        calls = [delayed(search_from, nominal, i, start, *budget) for i, start in enumerate(starts)]
        optimum = best_feasible([e for run in parallel(calls) for e in run.log])
        optima += [] if optimum is None else [(nominal, optimum)]
    calls, rows = [], []
    for requested, optimum in optima:
        starts = [requested.to_unit(optimum.x), *points]
        for at in _left_out_signals(requested):
            calls.append(delayed(_without, requested, at, starts, *budget))
            rows.append(
                dict(zip(_NAMES, (requested.objective.column, lights.types[at], lights.names[at]), strict=True))
            )
    answers = run_with_progress(parallel, calls, "lights left out", progress)
    figures = [dict(zip(_FIGURES, answer or (None,) * 3, strict=True)) for answer in answers]
    schema = pa.schema([*((name, pa.string()) for name in _NAMES), *((name, pa.float64()) for name in _FIGURES)])
    return pa.Table.from_pylist([row | values for row, values in zip(rows, figures, strict=True)], schema=schema)


def most_evaluations_left_out(study: Study, search: Search) -> int:
    """Return the largest number of evaluations of `left_out_table`."""
    problem = study.problem(search)
    optima = 2 if _has_nominal(problem) else 1
    searches = optima * len(_left_out_signals(problem)) + optima - 1
    return searches * _LEFT_OUT_STARTS * _evaluations_of_start(search)


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
