"""Search of a study on the cores: best design, upper bound, and trade-off."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any

import numpy as np
import pyarrow as pa

from ..base.errors import InfeasibleError, ValidationIssue
from ..base.types import Array, Float, Parallel, PerParameter, Progress, delayed
from ..designs.families.mixture import THICKNESS_UM
from ..designs.space import Space
from ..metrics.bound import FEASIBLE
from ..metrics.columns.sensitivity import cfa_sensitivity_at
from ..results.tables import front_schema, search_schema
from ..search.certificate import ROUNDING
from ..search.combinations import Choice, choose, numbers_of, with_members
from ..search.problem import Evaluation, Problem, SearchRun, best_feasible, starting_points
from ..search.solver import extreme_value, refinement_of, search_from, smooth_objective
from ..search.trade_off import Effort, FrontPoint, calls_at_levels, check_proof, gap_of, trade_off
from ..search.upper_bound import UpperBound, reason_without_bound, upper_bound_of
from ..study import Search, Study
from ..study.axes import series_of
from .as_read import Reading, best_as_read
from .between import Between, between, minima_between, or_nan
from .routes import Rules
from .rows import Rows, rows_of

_CM_PER_UM = 1e-4
_REACH_STARTS = 8
_MOST_CUTS, _CUT = 8, 1e-3
"""Times that scenes are added between those of a series, and by how much an answer must be worse there, relative."""
_MOST_HELD = 60
"""Evaluations of each start where some parameters are held: of a combination of colorants, or a cell of a map."""


@dataclass(frozen=True)
class SearchAnswer:
    """All starts of a search, the best feasible evaluation, its upper bound and the front.

    `scenario`: the one in which the best is worst, if several are searched. The first `starts` of `runs` are from
    starting points; `refinement`: the algorithm that continues from the best of these. `added`: scenes between the
    scenarios of a series, whose worst is that of the best.
    """

    search: Search
    scenario: str
    runs: tuple[SearchRun, ...]
    best: Evaluation
    upper_bound: UpperBound | None
    no_upper_bound: str | None
    front: tuple[FrontPoint, ...]
    choice: Choice | None = None
    refinement: str | None = None
    added: int = 0
    starts: int = 1

    @property
    def gap(self) -> float | None:
        """Relative distance of the answer below the proven upper bound."""
        return None if self.upper_bound is None else gap_of(self.best, self.upper_bound)


@dataclass(frozen=True)
class OtherSearch:
    """Search of a feature in place of `run_search`: its answer, its tables by their files' names, and its facts."""

    answer: SearchAnswer
    tables: Mapping[str, pa.Table]
    facts: Mapping[str, Any]


def run_search(study: Study, search: Search, rules: Rules, parallel: Parallel, progress: Progress) -> SearchAnswer:
    """Search from Sobol points and the best combination; the evaluations are shared evenly among the starts.

    A derivative-free search ends near its optimum at best: where derivatives exist, SLSQP continues from there, with
    as many evaluations as a start.

    Raises InfeasibleError if no start finds a feasible design, with the best reachable value of each constraint. Raises
    UpperBoundExceededError if a design exceeds its upper bound.
    """
    problem = study.problem(search)
    n_starts, refinement = min(search.starts, search.max_evaluations), refinement_of(problem, search.algorithm)
    choice = None
    if len(numbers_of(problem)) > 1:
        most = min(_MOST_HELD, search.max_evaluations)
        choice = choose(problem, search.algorithm, most, study.section.seed, parallel, progress)
        problem = with_members(problem, choice.best)
    starts = starting_points(problem, n_starts, study.section.seed)
    if choice is not None:
        starts[0] = problem.to_unit(choice.tried[choice.best].x)
    per_start = search.max_evaluations // n_starts
    effort = Effort(search.algorithm, starts, per_start, study.section.seed, refinement)
    no_upper_bound, series = reason_without_bound(problem), len(search.scenarios) > 1
    limited = no_upper_bound is None and not series
    # All at once, so that no core waits for another: few of these calls need results of others.
    calls = [
        delayed(search_from, problem, i, u, search.algorithm, per_start, effort.seed) for i, u in enumerate(starts)
    ]
    calls += [delayed(upper_bound_of, problem)] if limited else []
    answers = parallel([*calls, *calls_at_levels(problem, search.levels, effort, limited=limited)])
    runs: list[SearchRun] = []
    for run in islice(answers, n_starts):
        runs.append(run)
        progress("search starts", len(runs), n_starts)
    if refinement is not None:
        nearest = max((e for run in runs for e in run.log), key=lambda evaluation: evaluation.rank)
        runs.append(search_from(problem, n_starts, problem.to_unit(nearest.x), refinement, per_start, effort.seed))
    best = best_feasible([e for run in runs for e in run.log])
    if best is None:
        raise _infeasible(study, problem, starts[:_REACH_STARTS], per_start)
    limit, worst, last = next(answers) if limited else None, 0, runs
    if series and (scenes := _series(study, search)) is not None:
        problem, best, more = _over_series(problem, scenes, best, runs, effort, parallel, progress)
        runs, last = runs + more, more or runs
    reading = Reading.of(study, search, rules)
    if (run := best_as_read(problem, reading, last, effort, progress)) is not None:
        runs, best = [*runs, run], run.log[-1]
    if series:
        alone = [problem.in_scenario(number) for number in range(len(search.scenarios))]
        worst = int(np.argmin([smooth_objective(scene_problem, best.x) for scene_problem in alone]))
        no_upper_bound = reason_without_bound(alone[worst])
        # No filter's worst value is above the bound of any one scenario.
        limit = next(iter(parallel([delayed(upper_bound_of, alone[worst])]))) if no_upper_bound is None else None
    check_proof(best, limit)
    front = trade_off(problem, search.levels, effort, answers, parallel, progress, limited=limited)
    return SearchAnswer(
        search,
        search.scenarios[worst],
        tuple(runs),
        best,
        limit,
        no_upper_bound,
        front,
        choice,
        refinement,
        len(problem.scenes) - len(search.scenarios),
        n_starts,
    )


def _series(study: Study, search: Search) -> tuple[Between, list[float]] | None:
    """Return the scenes between the scenarios of a search, and their numbers; None if they are no series."""
    for scenarios in series_of(study.scenarios).values():
        if [*scenarios] == [*search.scenarios]:
            scenes = between(study, study.setup(search.space, search.scenarios[0]), scenarios)
            return None if scenes is None else (scenes, [*scenarios.values()])
    return None


def _over_series(
    problem: Problem,
    series: tuple[Between, list[float]],
    best: Evaluation,
    runs: Sequence[SearchRun],
    effort: Effort,
    parallel: Parallel,
    progress: Progress,
) -> tuple[Problem, Evaluation, list[SearchRun]]:
    """Search for the worst value over all numbers of a series: add the scenes where the answer is worse, and go on."""
    algorithm, more = effort.refinement or effort.algorithm, list[SearchRun]()
    others = [e for run in runs if (e := best_feasible(run.log)) is not None and e.objective < best.objective]
    other = max(others, key=lambda e: e.objective, default=best)
    evaluations = min(effort.evaluations, _MOST_HELD)
    for number in range(_MOST_CUTS):
        minima = next(iter(parallel([delayed(_worst_scenes, problem, *series, best.x)])))
        worse = [at for at, value in minima if value < best.objective - _CUT * abs(best.objective)]
        progress("scenes between scenarios", number + 1, _MOST_CUTS if worse else number + 1)
        if not worse:
            break
        scenes = [(series[0].at(at), problem.family) for at in worse]
        problem = replace(problem, others=(*problem.others, *scenes))
        starts = [problem.to_unit(design.x) for design in (best, other)]
        first = len(runs) + len(more)
        calls = [
            delayed(search_from, problem, first + at, u, algorithm, evaluations, effort.seed)
            for at, u in enumerate(starts)
        ]
        more += parallel(calls)
        found = best_feasible([e for run in more[-len(calls) :] for e in run.log])
        best = best if found is None else found
    return problem, best, more


def _worst_scenes(
    problem: Problem, scenes: Between, numbers: Sequence[float], x: PerParameter
) -> list[tuple[float, float]]:
    """Return the numbers of a series at which the objective of a design is lowest, and its values."""

    def value(number: float) -> float:
        return smooth_objective(replace(problem, setup=scenes.at(number), others=()), x)

    return minima_between(or_nan(value), numbers)


def limit_alone(study: Study, search: Search) -> UpperBound | None:
    """Compute the upper bound of `run_search` without a search.

    None if there is no upper bound.
    """
    problem = study.problem(search)
    return upper_bound_of(problem) if reason_without_bound(problem) is None else None


def _infeasible(study: Study, problem: Problem, starts: Float[Array, "starts free"], per_start: int) -> InfeasibleError:
    issues = [ValidationIssue(f"{study.name}: no feasible design was found")]
    for name, bound in problem.constraints.items():
        value = extreme_value(problem, name, starts, per_start)
        met = "reachable alone" if bound.violation(np.array([value]))[0] <= FEASIBLE else "out of reach"
        best = f"the best value found is {value:.6g}" if np.isfinite(value) else "no well-formed filter was found"
        issues.append(ValidationIssue(f"{met}: {name} {bound}; {best}", key=f"constraints.{name}"))
    return InfeasibleError(issues)


def answer_rows(study: Study, answer: SearchAnswer, rules: Rules, parallel: Parallel) -> list[pa.Table]:
    """Return the search's answer as the camera reads it out in each scenario, with its upper bound and gap.

    Upper bound and gap stand in the scenario that they hold for.
    """
    space = answer.search.space
    best = Space(
        "search", answer.search.name, space.cfa, space.filter, tuple((float(value),) for value in answer.best.x)
    )
    ids, first = study.n_designs + np.arange(len(answer.search.scenarios)), np.zeros(1, dtype=np.intp)
    jobs = [
        Rows(best, scenario, first, ids[at : at + 1], first + study.n_filters)
        for at, scenario in enumerate(answer.search.scenarios)
    ]
    # Workers have loaded what this takes, and this process has not.
    rows = parallel([delayed(rows_of, job, study.setup(best, job.scenario), rules, rules.wanted) for job in jobs])
    proven = None if answer.upper_bound is None else answer.upper_bound.proven
    tables: list[pa.Table] = []
    for job, row in zip(jobs, rows, strict=True):
        tables.append(row)
        bound = {"upper_bound": proven, "gap": answer.gap} if job.scenario == answer.scenario else {}
        for name, value in {"space": space.name, **bound}.items():
            index, kind = row.schema.get_field_index(name), row.schema.field(name)
            tables[-1] = tables[-1].set_column(index, kind, pa.array([value]).cast(kind.type))
    return tables


def search_facts(study: Study, answer: SearchAnswer) -> dict[str, Any]:
    """Return the search in figures, for provenance and summary."""
    search, space, limit = answer.search, answer.search.space, answer.upper_bound
    return {
        "algorithm": search.algorithm,
        "scenario": answer.scenario,
        "scenarios": len(search.scenarios),
        "space": space.name,
        "cfa": space.cfa,
        "channel": " and ".join(space.filter.channels) if space.filter else "",
        "bounded": [] if limit is None else bounded_spaces(study, search),
        "starts": answer.starts,
        "scenes_added": answer.added,
        "refinement": answer.refinement,
        "evaluations": sum(len(run.log) for run in answer.runs),
        "endings": [run.status for run in answer.runs],
        "objective": str(study.objective),
        "best_smooth_objective": answer.best.objective,
        "best_sensitivity": answer.best.sensitivity,
        "upper_bound_attained": None if limit is None or limit.curve is None else limit.attained,
        "upper_bound_proven": None if limit is None else limit.proven,
        "upper_bound_left_out": [] if limit is None else list(limit.left_out),
        "upper_bound_programs": None if limit is None else limit.programs,
        "upper_bound_open_parts": None if limit is None else limit.open_parts,
        "front_upper_bounds_open": sum(
            p.upper_bound is not None and p.upper_bound.open_parts > 0 for p in answer.front
        ),
        "upper_bound_of_box": limit is not None and limit.of_box,
        "gap": answer.gap,
        "no_upper_bound": answer.no_upper_bound,
        "combinations": [] if answer.choice is None else list(answer.choice.counts),
        "front_evaluations": sum(len(run.log) for point in answer.front for run in point.runs),
    }


def bounded_spaces(study: Study, search: Search) -> list[str]:
    """Return the design spaces whose feasible filters the upper bound holds for, in the search's scenario.

    They are in the same channel of the same CFA, replace the same curve, nowhere exceed it, and have the same
    technology.
    """
    searched = search.space.filter
    assert searched is not None
    names = [f"search {search.space.name}"]
    for space in study.spaces:
        filter_of_space, same = space.filter, (search.space.cfa, searched.bases, searched.technology)
        if filter_of_space is None or (space.cfa, filter_of_space.bases, filter_of_space.technology) != same:
            continue
        low, high = (np.array([end(axis) for axis in space.axes], dtype=float) for end in (min, max))
        (base,) = (study.sensor.curve(name) for name in filter_of_space.bases.values())
        if (filter_of_space.family.upper(low, high)[0] <= base * (1 + ROUNDING)).all():
            names.append(f"{space.kind} {space.name}")
    return names


def search_log(answer: SearchAnswer) -> pa.Table:
    """Return every evaluation of every start, of the search and then of each level of the front."""
    names = answer.search.space.parameters
    rows = [
        {
            "scenario": answer.scenario,
            "sensitivity_min": level,
            "start": run.start,
            "evaluation": index,
            **dict(zip(names, map(float, e.x), strict=True)),
            "objective": e.objective,
            "sensitivity": e.sensitivity,
            "cfa_sensitivity": e.cfa_sensitivity,
            "violation": e.violation,
            "status": run.status,
        }
        for level, runs in ((None, answer.runs), *((point.level, point.runs) for point in answer.front))
        for run in runs
        for index, e in enumerate(run.log)
    ]
    return pa.Table.from_pylist(rows, schema=search_schema(names))


def combinations_table(study: Study, answer: SearchAnswer) -> pa.Table:
    """Return one row per combination of colorants that was tried, the best first.

    The concentration of a colorant whose catalog has molar extinctions e is absorbance / (e 0.8 um) (law of Beer and
    Lambert).
    """
    assert answer.choice is not None
    assert study.colorants is not None
    names, parameters = study.colorants.names, answer.search.space.parameters
    molar = study.section.colorants is not None and study.section.colorants.quantity == "molar_extinction"
    rows = []
    for members, best in sorted(answer.choice.tried.items(), key=lambda item: item[1].rank, reverse=True):
        x = dict(zip(parameters, map(float, best.x), strict=True))
        row: dict[str, Any] = {"colorants": len(members)}
        for slot, number in enumerate(members, 1):
            absorbance = x[f"absorbance_{slot}"]
            row |= {f"colorant_{slot}": number, f"name_{slot}": names[number - 1], f"absorbance_{slot}": absorbance}
            if molar:
                row[f"mol_per_l_{slot}"] = absorbance / (study.colorants.peaks[number - 1] * THICKNESS_UM * _CM_PER_UM)
        row |= {"thickness_um": x["thickness_um"], "objective": best.objective, "sensitivity": best.sensitivity}
        row |= {"violation": best.violation, "feasible": best.feasible}
        rows.append(row)
    columns = dict.fromkeys(name for row in sorted(rows, key=lambda row: -len(row)) for name in row)
    return pa.table({name: [row.get(name) for row in rows] for name in columns})


def front_table(study: Study, answer: SearchAnswer) -> pa.Table:
    """Return one row per level of sensitivity, and rows in between with the upper bound alone."""
    names, setup = answer.search.space.parameters, study.setup(answer.search.space, answer.search.scenario)
    rows = []
    for point in answer.front:
        row: dict[str, Any] = {"sensitivity_min": point.level, "evaluations": sum(len(run.log) for run in point.runs)}
        row["cfa_sensitivity_min"] = cfa_sensitivity_at(setup, point.level)
        if point.best is not None:
            row |= {"objective": point.best.objective, "sensitivity": point.best.sensitivity}
            row["cfa_sensitivity"] = point.best.cfa_sensitivity
            row |= dict(zip(names, map(float, point.best.x), strict=True))
        if point.upper_bound is not None and np.isfinite(point.upper_bound.proven):
            row["upper_bound"] = point.upper_bound.proven
            row["gap"] = None if point.best is None else gap_of(point.best, point.upper_bound)
        rows.append(row)
        for sensitivity, proven in point.onward:
            if np.isfinite(proven):
                cfa_sensitivity = cfa_sensitivity_at(setup, sensitivity)
                rows.append(
                    {"sensitivity_min": sensitivity, "cfa_sensitivity_min": cfa_sensitivity, "upper_bound": proven}
                )
    return pa.Table.from_pylist(rows, schema=front_schema(names))
