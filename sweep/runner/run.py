"""The whole run: search, sweep, front, files. What is finished survives a kill."""

from __future__ import annotations

import functools
import itertools
import time
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import joblib
import numpy as np
import pyarrow as pa

from ..errors import InterruptedRunError
from ..pareto import hypervolume
from ..store import (
    CURVES,
    FRONT,
    POINTS,
    PROVENANCE,
    RECOGNITION,
    RESOLVED,
    RESULTS,
    SEARCH_LOG,
    Shards,
    locked,
    write_json,
    write_table,
    write_text,
)
from ..study import Study
from .drawn import curves_table, points_table
from .jobs import Rules, jobs_of, mark_front, rules_of, run_job
from .patches import recognition_table
from .planning import with_plans
from .provenance import fingerprint, plan_facts, provenance, resolved_yaml
from .searching import Parallel, Progress, SearchAnswer, answer_row, front_table, run_search, search_facts, search_log
from .stopping import Stop, leave_signals_to_the_parent, stop_on_signals


def run_study(study: Study, output: Path, n_jobs: int, progress: Progress, command: Sequence[str] = ()) -> None:
    """Run a study into `output`; finished chunks of an earlier, interrupted run of the same study are kept.

    Writes `results.parquet`, `search.parquet` (when the study searches), `curves.parquet`, `points.parquet`,
    `study.resolved.yaml` and `provenance.json`, each atomically. Raises OutputError when the folder is in use or cannot
    be written, and InfeasibleError, before anything is written, when the study's search finds no feasible design.
    """
    started = time.monotonic()
    study = with_plans(study, n_jobs, progress)
    rules = rules_of(study)
    with stop_on_signals() as stop:
        parallel = functools.partial(_parallel, n_jobs, stop)
        # Searched first: a study that no design meets ends here, before anything is written.
        answer = None if study.search is None else run_search(study, study.search, parallel, progress)
        with locked(output):
            _write(study, answer, output, rules, parallel, progress, started, n_jobs, command)


def _write(
    study: Study,
    answer: SearchAnswer | None,
    output: Path,
    rules: Rules,
    parallel: Parallel,
    progress: Progress,
    started: float,
    n_jobs: int,
    command: Sequence[str],
) -> None:
    """Sweep, and write everything."""
    shards = Shards(output)
    table = _sweep(study, rules, shards, parallel, progress)
    facts: dict[str, Any] = {
        "designs": table.num_rows,
        "plans": plan_facts(study),
        "trade_off": study.trade_off,
        "warnings": list(study.warnings),
    }
    if answer is not None:
        table = pa.concat_tables([table, answer_row(study, answer, rules, table.num_rows)])
        facts["search"] = search_facts(study, answer)
        if study.plans[answer.search.scenario].methods.saturation == "clip":
            facts["warnings"].append("signals can saturate; the search sees the response before that, its row after")
    table = mark_front(table, rules)
    for name, made in (
        (RESULTS, table),
        (SEARCH_LOG, None if answer is None else search_log(answer)),
        (FRONT, None if answer is None or not answer.front else front_table(answer)),
        (CURVES, curves_table(study, table, None if answer is None else answer.limit)),
        (POINTS, points_table(study, table)),
        (RECOGNITION, recognition_table(study, table, parallel, progress)),
    ):
        if made is None:
            (output / name).unlink(missing_ok=True)  # of an earlier run of another study
        else:
            write_table(made, output / name)
    if answer is not None and answer.front:
        facts["hypervolume"] = _hypervolumes(study, table, answer)
    write_text(resolved_yaml(study), output / RESOLVED)
    write_json(provenance(study, n_jobs, command, time.monotonic() - started) | facts, output / PROVENANCE)
    shards.remove()


def _hypervolumes(study: Study, table: pa.Table, answer: SearchAnswer) -> dict[str, float]:
    """Area that the sweep's and the search's front dominate above no separation and the lowest level of sensitivity."""
    reference = np.array([0.0, answer.search.levels[0] - 1e-6])
    axes = list(study.trade_off)
    frame = table.select([*axes, "pareto", "kind", "cfa", "scenario"]).to_pandas()
    frame = frame[frame["scenario"] == answer.search.scenario]
    swept = frame[frame["pareto"] & (frame["kind"] == "sweep") & (frame["cfa"] == answer.search.space.cfa)]
    traced = np.array([[p.best.objective, p.best.sensitivity] for p in answer.front if p.best is not None]).reshape(
        -1, 2
    )
    return {
        "sweep": hypervolume(swept[axes].to_numpy(dtype=float), reference),
        "search": hypervolume(traced, reference),
    }


def _sweep(study: Study, rules: Rules, shards: Shards, parallel: Parallel, progress: Progress) -> pa.Table:
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
    for index, table in zip(todo, parallel(tasks), strict=False):
        shards.save(index, key, table)
        tables[index] = table
        done += table.num_rows
        progress("designs", done, study.n_designs)
    return pa.concat_tables([rules.schema.empty_table(), *(tables[i] for i in range(len(jobs)))])


def _parallel(n_jobs: int, stop: Stop, tasks: Iterable[Any]) -> Iterator[Any]:
    """Results in the order of the tasks; the workers' own libraries use one thread each.

    Raises InterruptedRunError after a stop was asked for and everything under way has been handed out.
    """
    wanted = itertools.takewhile(lambda _: not stop.requested, tasks)
    settings = {"inner_max_num_threads": 1, "initializer": leave_signals_to_the_parent}
    with joblib.parallel_config("loky", **settings):
        yield from joblib.Parallel(n_jobs=n_jobs, return_as="generator", pre_dispatch="3*n_jobs")(wanted)
    if stop.requested:
        raise InterruptedRunError("interrupted; finished chunks are kept, the same command continues")
