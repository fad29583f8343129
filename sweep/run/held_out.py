"""How designs do on lights that they have not seen: other lights, and each light that is left out of a search."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from ..base.types import FloatArray, Parallel, Progress, delayed
from ..camera.forward import forward_model
from ..camera.setup import Setup
from ..curves.lights import Lights, class_pairs
from ..metrics.evaluate import evaluate
from ..metrics.objective import Objective
from ..metrics.quantity import HELD_OUT, WORST_CASE
from ..metrics.separation import csd_name
from ..results.designs import computed_rows, row_curves
from ..search.problem import Evaluation, Problem, best_feasible, starting_points
from ..search.solver import search_from, smooth_objective
from ..search.trade_off import Effort
from ..study import Search, Study

if TYPE_CHECKING:
    import pandas as pd

_LEFT_OUT_STARTS = 4
"""Of each search without a light."""
_FIGURES = ("seen", "with_it", "fall")


def held_out_table(
    study: Study, rows: pd.DataFrame, on_front: pd.DataFrame, parallel: Parallel, progress: Progress
) -> pa.Table:
    """Columns `design_id` and `held_out_csd_<a>_<b>`, DN, of the rows to draw and of the front.

    The scenes are those of the study, by the methods of their plans, with the other lights in place of its own.
    """
    assert study.held_out is not None
    lights = study.held_out
    shown = computed_rows(rows, on_front)
    calls = []
    for row in shown:
        space, curves = row_curves(study, row)
        calls.append(delayed(_on_lights, replace(study.setup(space, row["scenario"]), lights=lights), curves))
    found: list[dict[str, Any]] = []
    for row, values in zip(shown, parallel(calls), strict=True):
        found.append({"design_id": row["design_id"], **values})
        progress("held-out lights", len(found), len(shown))
    names = [HELD_OUT + csd_name(pair) for pair in class_pairs(lights.classes)]
    schema = pa.schema([("design_id", pa.int64()), *((name, pa.float64()) for name in names)])
    return pa.Table.from_pylist(found, schema=schema)


def _on_lights(setup: Setup, curves: FloatArray) -> dict[str, float]:
    columns = evaluate(forward_model(setup), np.asarray(curves, dtype=float))
    names = [csd_name(pair) for pair in class_pairs(setup.lights.classes)]
    return {HELD_OUT + name: float(columns[name][0]) for name in names}


def left_out_table(study: Study, search: Search, best: Evaluation, parallel: Parallel, progress: Progress) -> pa.Table:
    """A row per light of the objective: the search without it, and what its optimum falls to with it.

    Columns `objective`, `signal_type`, `signal`; `seen`: the objective of the optimum without the light, `with_it`:
    that of the same design with all lights, `fall`: the difference; before quantization. Each search starts from the
    study's answer and a few other points. Of an objective that is a worst case the nominal quantity is searched, too.
    A light that is alone in its type cannot be left out.
    """
    problem, seed = study.problem(search), study.section.seed
    lights = study.lights
    points = starting_points(problem, _LEFT_OUT_STARTS - 1, seed)
    effort = Effort(search.algorithm, points, _evaluations_of_start(search), seed)
    optima: list[tuple[Problem, Evaluation]] = [(problem, best)]
    if _has_nominal(problem):
        nominal = _nominal_problem(problem)
        calls = [
            delayed(search_from, nominal, i, u, effort.algorithm, effort.evaluations, seed)
            for i, u in enumerate([problem.to_unit(best.x), *points])
        ]
        optimum = best_feasible([e for run in parallel(calls) for e in run.log])
        optima += [] if optimum is None else [(nominal, optimum)]
    tasks = []
    rows: list[dict[str, Any]] = []
    for asked, optimum in optima:
        starts = [asked.to_unit(optimum.x), *points]
        for at in _left_out_signals(asked):
            tasks.append(delayed(_without, asked, at, starts, effort.algorithm, effort.evaluations, seed))
            names = {"signal_type": lights.types[at], "signal": lights.names[at]}
            rows.append({"objective": asked.objective.column, **names})
    for done, (row, answer) in enumerate(zip(rows, parallel(tasks), strict=True), 1):
        row |= dict(zip(_FIGURES, answer or (None,) * len(_FIGURES), strict=True))
        progress("lights left out", done, len(rows))
    fields = [(name, pa.string()) for name in ("objective", "signal_type", "signal")]
    return pa.Table.from_pylist(rows, schema=pa.schema([*fields, *((name, pa.float64()) for name in _FIGURES)]))


def most_evaluations_left_out(study: Study, search: Search) -> int:
    """Evaluations of `left_out_table` at most."""
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


def _nominal_problem(problem: Problem) -> Problem:
    """Problem whose objective is the quantity without production tolerances, in place of its worst case."""
    of = problem.quantities[problem.objective.column].of
    return replace(problem, objective=Objective(minimum={of: 1.0}))


def _left_out_signals(problem: Problem) -> list[int]:
    """Lights of the objective's types that are not alone in theirs."""
    asked = {name for column in problem.objective.weights for name in _types(problem, column)}
    lights = problem.setup.lights
    members = {name: len(own) for name, own in lights.members.items()}
    return [i for i, kind in enumerate(lights.types) if kind in asked and members[kind] > 1]


def _types(problem: Problem, column: str) -> tuple[str, ...]:
    quantity = problem.quantities[column]
    if quantity.needs == "own":  # it may be of any
        return problem.setup.lights.classes
    return quantity.states if quantity.pair is None else quantity.pair


def _without(
    problem: Problem, light: int, starts: Sequence[FloatArray], algorithm: str, evaluations: int, seed: int
) -> tuple[float, float, float] | None:
    """The optimum without a light: its objective without and with it, and the difference; None without a design."""
    fewer = replace(problem, setup=replace(problem.setup, lights=_some(problem.setup.lights, light)))
    log = [e for i, u in enumerate(starts) for e in search_from(fewer, i, u, algorithm, evaluations, seed).log]
    found = best_feasible(log)
    if found is None:
        return None
    whole = smooth_objective(problem, found.x)
    return found.objective, whole, found.objective - whole


def _some(lights: Lights, left_out: int) -> Lights:
    """All lights but one; the photons of the others stay as they are."""
    kept = [i for i in range(len(lights.names)) if i != left_out]
    return replace(
        lights,
        names=tuple(lights.names[i] for i in kept),
        types=tuple(lights.types[i] for i in kept),
        photons=lights.photons[kept],
    )
