"""The whole run: sweep, search, front, files. What is finished survives a kill."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import joblib
import pyarrow as pa

from ..errors import InterruptedRunError
from ..evaluate import quantities
from ..search import Evaluation, SearchRun, best_feasible, search_from, starting_points
from ..spaces import Space
from ..store import (
    CURVES,
    POINTS,
    PROVENANCE,
    RESOLVED,
    RESULTS,
    SEARCH_LOG,
    Shards,
    locked,
    result_schema,
    search_schema,
    write_json,
    write_table,
    write_text,
)
from ..study import Search, Study
from .drawn import curves_table, points_table
from .jobs import Job, Rules, jobs_of, mark_front, run_job
from .provenance import fingerprint, provenance, resolved_yaml
from .stopping import Stop, leave_signals_to_the_parent, stop_on_signals

Progress = Callable[[str, int, int], None]
"""Called with the phase's name, how much is done, and the total."""


@dataclass(frozen=True)
class SearchAnswer:
    """All starts of a search and the best feasible evaluation among them."""

    search: Search
    runs: tuple[SearchRun, ...]
    best: Evaluation | None


def run_study(study: Study, output: Path, n_jobs: int, progress: Progress, command: Sequence[str] = ()) -> None:
    """Run a study into `output`; finished chunks of an earlier, interrupted run of the same study are kept.

    Writes `results.parquet`, `search.parquet` (when the study searches), `curves.parquet`, `points.parquet`,
    `study.resolved.yaml` and `provenance.json`, each atomically. Raises OutputError when the folder is in use or cannot
    be written.
    """
    started = time.monotonic()
    schema = result_schema(study.parameters, quantities(study.lights))
    rules = Rules(schema, study.constraints, (study.objective_column, "sensitivity"))
    with locked(output), stop_on_signals() as stop:
        shards = Shards(output)
        table = _sweep(study, rules, shards, n_jobs, progress, stop)
        facts: dict[str, Any] = {"designs": table.num_rows, "warnings": list(study.warnings)}
        if study.search is not None:
            answer = _search(study, study.search, n_jobs, progress, stop)
            table = pa.concat_tables([table, *_answer_row(study, answer, rules, table.num_rows)])
            facts["search"] = _search_facts(study, answer)
            write_table(_search_log(answer), output / SEARCH_LOG)
        else:
            (output / SEARCH_LOG).unlink(missing_ok=True)
        table = mark_front(table, rules)
        write_table(table, output / RESULTS)
        write_table(curves_table(study, table), output / CURVES)
        write_table(points_table(study, table), output / POINTS)
        write_text(resolved_yaml(study), output / RESOLVED)
        origin = provenance(study, n_jobs, command, time.monotonic() - started)
        write_json(origin | facts, output / PROVENANCE)
        shards.remove()


def _sweep(study: Study, rules: Rules, shards: Shards, n_jobs: int, progress: Progress, stop: Stop) -> pa.Table:
    key = fingerprint(study)
    jobs = list(jobs_of(study))
    setups = {
        (s.kind, s.name, scenario): study.setup(s, scenario) for scenario in study.scenarios for s in study.spaces
    }
    tables = {i: kept for i in range(len(jobs)) if (kept := shards.load(i, key, rules.schema)) is not None}
    todo = [i for i in range(len(jobs)) if i not in tables]
    done = sum(table.num_rows for table in tables.values())
    progress("designs", done, study.n_designs)
    tasks = (
        joblib.delayed(run_job)(job, setups[job.space.kind, job.space.name, job.scenario], rules)
        for job in (jobs[i] for i in todo)
    )
    for index, table in zip(todo, _parallel(n_jobs, tasks, stop), strict=False):
        shards.save(index, key, table)
        tables[index] = table
        done += table.num_rows
        progress("designs", done, study.n_designs)
    return pa.concat_tables([tables[i] for i in range(len(jobs))])


def _search(study: Study, search: Search, n_jobs: int, progress: Progress, stop: Stop) -> SearchAnswer:
    """Search from Sobol points over the cores; the evaluations are shared evenly among the starts."""
    problem = study.problem(search)
    starts = starting_points(problem.free.size, search.starts, study.section.seed)
    each = max(1, search.max_evaluations // search.starts)
    tasks = (joblib.delayed(search_from)(problem, i, u, search.algorithm, each) for i, u in enumerate(starts))
    runs: list[SearchRun] = []
    for run in _parallel(n_jobs, tasks, stop):
        runs.append(run)
        progress("search starts", len(runs), search.starts)
    return SearchAnswer(search, tuple(runs), best_feasible([e for run in runs for e in run.log]))


def _parallel(n_jobs: int, tasks: Iterable[Any], stop: Stop) -> Iterator[Any]:
    """Results in the order of the tasks; the workers' own libraries use one thread each.

    Raises InterruptedRunError after a stop was asked for and everything under way has been handed out.
    """
    wanted = itertools.takewhile(lambda _: not stop.requested, tasks)
    settings = {"inner_max_num_threads": 1, "initializer": leave_signals_to_the_parent}
    with joblib.parallel_config("loky", **settings):
        yield from joblib.Parallel(n_jobs=n_jobs, return_as="generator", pre_dispatch="3*n_jobs")(wanted)
    if stop.requested:
        raise InterruptedRunError("interrupted; finished chunks are kept, the same command continues")


def _answer_row(study: Study, answer: SearchAnswer, rules: Rules, first_id: int) -> list[pa.Table]:
    """The search's answer as the camera reads it out."""
    if answer.best is None:
        return []
    space = answer.search.space
    axes = tuple((float(value),) for value in answer.best.x)
    found = Space("search", f"best of {space.name}", space.cfa, space.filter, axes)
    job = Job(found, answer.search.scenario, 0, 1, first_id)
    return [run_job(job, study.setup(found, job.scenario), rules)]


def _search_facts(study: Study, answer: SearchAnswer) -> dict[str, Any]:
    best = answer.best
    return {
        "algorithm": answer.search.algorithm,
        "scenario": answer.search.scenario,
        "sweep": answer.search.space.name,
        "starts": len(answer.runs),
        "evaluations": sum(len(run.log) for run in answer.runs),
        "endings": [run.status for run in answer.runs],
        "objective": study.objective_column,
        "best_smooth_csd_dn": None if best is None else best.csd,
        "best_sensitivity": None if best is None else best.sensitivity,
    }


def _search_log(answer: SearchAnswer) -> pa.Table:
    names = answer.search.space.parameters
    rows = [
        {
            "scenario": answer.search.scenario,
            "start": run.start,
            "evaluation": index,
            **dict(zip(names, map(float, e.x), strict=True)),
            "csd_dn": e.csd,
            "sensitivity": e.sensitivity,
            "cfa_sensitivity": e.cfa_sensitivity,
            "violation": e.violation,
            "status": run.status,
        }
        for run in answer.runs
        for index, e in enumerate(run.log)
    ]
    return pa.Table.from_pylist(rows, schema=search_schema(names))
