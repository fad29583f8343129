"""Dry run: filters, scenarios, rows, their time and size from a sample, evaluations at most, and computed effects."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from threadpoolctl import threadpool_limits

from ..base.types import DesignNumbers
from ..features import modules
from ..results.dataset import encoded_part, part_name
from ..results.folder import run_in
from ..results.identity import run_facts
from ..results.tables import REFERENCE
from ..search.solver import refinement_of
from ..search.trade_off import most_searches
from ..study import Study
from .rows import Job, parts_of, rules_of, run_job

_SAMPLED_S = 1.0
"""Time for which rows are computed as a sample, s."""
_FEW = 64
"""Designs of each job that are computed with and without effects."""


@dataclass(frozen=True)
class Sample:
    """Rows that were computed to see how long they take, s, and the size of each, and of a file without rows, bytes."""

    rows: int
    seconds: float
    row_size: float
    empty_size: int


@dataclass(frozen=True)
class RemainingWork:
    """Remaining work of a study; `sample`: None if no row is left."""

    study: Study
    finished: int
    chunks: int
    searches: bool
    workers: int
    sample: Sample | None

    @property
    def rows(self) -> int:
        """Rows to compute."""
        return self.study.n_designs - self.finished

    @property
    def seconds(self) -> float:
        """Time that the rows take, s."""
        return 0.0 if self.sample is None else self.rows * self.sample.seconds / self.sample.rows / self.workers

    @property
    def megabytes(self) -> float:
        """Size of the rows."""
        if self.sample is None:
            return 0.0
        return (self.rows * self.sample.row_size + self.chunks * self.sample.empty_size) / 1e6

    @property
    def facts(self) -> dict[str, Any]:
        """The same as plain values."""
        counts = {"designs": self.study.n_designs, "finished_designs": self.finished, "parts": self.chunks}
        return {**counts, "searches": self.searches, "seconds": self.seconds, "megabytes": self.megabytes}


def remaining_work(study: Study, output: Path, n_workers: int = 1) -> RemainingWork:
    """Plan a study, read which parts are kept, and compute a sample of the rows; nothing is written."""
    held, parts = run_in(output), parts_of(study)
    is_finished = held is not None and held.is_of(run_facts(study)) and held.finished
    todo = [part for part in parts if not is_finished and not (output / part_name(part.number)).is_file()]
    rows = sum(part.size for part in todo)
    searches = study.search is not None and not is_finished
    planned = study.with_plans()
    sample = _sampled(planned, [job for part in todo for job in part.jobs])
    return RemainingWork(planned, study.n_designs - rows, len(todo), searches, n_workers, sample)


def seconds_of_effects(planned: Study) -> tuple[float, float] | None:
    """Measure what the effects that a bound leaves out save, on a sample of rows.

    Returns the processor time of all rows as planned, and with every effect, s; None if no bound leaves one out.
    """
    if not any(plan.error_bound_dn for plan in planned.plans.values()):
        return None
    jobs = [replace(job, stop=min(job.stop, job.start + _FEW)) for part in parts_of(planned) for job in part.jobs]
    studies, seconds, rows, order = (planned, replace(planned, plans={})), np.zeros(2), 0, spread(len(jobs))
    for sampled, at in enumerate((*order[:1], *order)):
        for index, study in enumerate(studies):
            begun = time.process_time()
            with threadpool_limits(1):  # as in a worker
                run_job(jobs[at], study, rules_of(study))
            if sampled:  # the first once before, to load code
                seconds[index] += time.process_time() - begun
        rows += jobs[at].size if sampled else 0
        if seconds.sum() > _SAMPLED_S:
            break
    own_s, all_s = (seconds * (planned.n_designs / rows)).tolist()
    return own_s, all_s


def _sampled(study: Study, jobs: Sequence[Job]) -> Sample | None:
    """Compute jobs that are spread over all of them, until the time is over; the first once before, to load code."""
    rules, tables, seconds = rules_of(study), list[pa.Table](), 0.0
    order = spread(len(jobs))
    for at in (*order[:1], *order):
        begun = time.perf_counter()
        with threadpool_limits(1):  # as in a worker
            table = run_job(jobs[at], study, rules)
        if not tables:
            tables.append(table.slice(0, 0))
            continue
        seconds += time.perf_counter() - begun
        tables.append(table)
        if seconds > _SAMPLED_S:
            break
    if not tables:
        return None
    table, empty_size = pa.concat_tables(tables).unify_dictionaries(), len(encoded_part(tables[0], ""))
    row_size = (len(encoded_part(table, "")) - empty_size) / len(table)
    return Sample(len(table), max(seconds, 1e-9), row_size, empty_size)


def spread(n: int) -> DesignNumbers:
    """Return 0 to n - 1 in an order whose every prefix covers the range evenly; 0 first."""
    golden = (math.sqrt(5) - 1) / 2
    return np.argsort(np.arange(n) * golden % 1.0, kind="stable")


def remaining_work_lines(todo: RemainingWork, output: Path) -> Iterator[str]:
    """Yield lines that describe the remaining work."""
    study, search = todo.study, todo.study.search
    plain = sum(space.size for space in study.spaces if space.kind == REFERENCE)
    yield (
        f"{_count(study.n_filters - plain, 'filter')} and {_count(plain, 'plain CFA')} "
        f"in {_count(len(study.scenarios), 'scenario')}, {_count(study.n_designs, 'row')}: "
        f"{todo.finished:,} finished, {todo.rows:,} in {_count(todo.chunks, 'chunk')} to compute."
    )
    if todo.sample is not None:
        time_and_size = f"{_duration(todo.seconds)} with {_count(todo.workers, 'worker')} and {todo.megabytes:.2g} MB"
        sampled = f"by a sample of {_count(todo.sample.rows, 'row')} here"
        yield f"Rows take about {time_and_size}, {sampled}; search, check and report come on top."
    if search is not None and not todo.searches:
        yield "The search is finished."
    elif search is not None:
        starts = min(search.starts, search.max_evaluations)
        per_start = search.max_evaluations // starts
        refinement = refinement_of(study.problem(search), search.algorithm)
        refined = refinement is not None
        then = f", then {refinement}" if refined else ""
        most = (starts + refined) * per_start
        yield f"Search: {_count(starts, 'start')}{then}, {_count(most, 'evaluation')} at most."
        if search.levels:
            most = most_searches(len(search.levels), starts, refined=refined) * per_start
            yield f"Its front: {_count(len(search.levels), 'level')}, {_count(most, 'evaluation')} at most."
        for module in modules("tables"):
            yield from getattr(module, "planned", lambda _: ())(study)
    groups: dict[tuple[str, ...], list[str]] = {}
    for name, plan in study.plans.items():
        groups.setdefault(plan.computed, []).append(name)
    for effects, names in groups.items():
        scenes = names[0] if len(names) == 1 else f"{names[0]} ... {names[-1]} ({len(names)} scenarios)"
        yield f"Effects computed in {scenes}: {', '.join(effects) or 'none'}."
    yield f"Results go to {output}/; nothing was written."


def _duration(seconds: float) -> str:
    """Return a time as people say it."""
    if seconds < 90:
        return f"{max(seconds, 1):.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.2g} h"


def _count(number: int, what: str) -> str:
    return f"{number:,} {what}{'' if number == 1 else 's'}"
