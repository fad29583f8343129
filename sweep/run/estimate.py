"""What a run would do: how much of it is finished already, and what the rest takes in time, memory and disk."""

from __future__ import annotations

import resource
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median

import pyarrow as pa

from ..base.types import Progress
from ..results.folder import held_by
from ..results.inventory import Inventory
from ..results.journal import Journal
from ..results.tables import FEW, RESULTS, encoded
from ..study import Study
from .of_rows import ROW_TABLES
from .plans import with_plans
from .rows import Job, rules_of
from .search_estimate import search_seconds
from .stop import Stop
from .sweep import Sweep
from .workers import Workers, one_thread

_SAMPLE = 256
_BUDGET_S = 10.0
_STARTED_S = 0.7
"""What libraries and compiled code take to load; `python -m tests.bench_estimate`."""
_Kind = tuple[str, str, str]


@dataclass(frozen=True)
class Estimate:
    """Designs in all and finished already; chunks, seconds, bytes of memory and of disk of the others.

    `evaluations`: about how many all searches take. `seconds` are those of everything but the report and what
    `on_top` names.
    """

    designs: int
    kept: int
    chunks: int
    seconds: float
    memory_bytes: float
    disk_bytes: float
    evaluations: int
    on_top: tuple[str, ...] = ()


def estimate(study: Study, output: Path, n_jobs: int, progress: Progress) -> Estimate:
    """Plan, look at what is kept, and compute a few designs of every kind of chunk in this process."""
    held = held_by(output)
    whole = held is not None and held.is_of(study) and not Inventory(output).wrong([RESULTS], quick=True)
    crew = Workers(n_jobs, Stop())
    study = with_plans(study, crew.count, progress)
    journal = Journal(output)
    journal.check()
    sweep = Sweep(study, rules_of(study), journal, crew)
    todo = [] if whole else [job for job, key in zip(sweep.jobs, sweep.keys, strict=True) if key not in journal.entries]
    rows = sum(job.stop - job.start for job in todo)
    seconds, bytes_per_row = 0.0, 0.0
    if todo:
        seconds, bytes_per_row = _sampled(sweep, todo)
        seconds += _STARTED_S * crew.count  # each worker loads them
    own = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
    evaluations = 0
    if study.search is not None and not whole:
        searched_s, evaluations = search_seconds(study, study.search)
        seconds += searched_s
    memory = float(own) * (crew.count + 1 if crew.count > 1 else 1)
    return Estimate(
        study.n_designs,
        study.n_designs - rows,
        len(todo),
        seconds / crew.count,
        memory,
        2 * rows * bytes_per_row,
        evaluations,
        () if whole else _on_top(study),
    )


def _on_top(study: Study) -> tuple[str, ...]:
    """What is not timed."""
    tables = [table.long for table in ROW_TABLES.values() if table.long and table.asked(study)]
    return (*tables, *(["images of signal heads"] if study.section.vision else []))


def _sampled(sweep: Sweep, todo: list[Job]) -> tuple[float, float]:
    """Seconds of one worker for all of `todo`, and bytes per row, from the first designs of each kind of chunk."""
    rows: dict[_Kind, int] = {}
    firsts: dict[_Kind, Job] = {}
    for job in todo:
        kind: _Kind = (job.space.kind, job.space.name, job.scenario)
        rows[kind] = rows.get(kind, 0) + job.stop - job.start
        firsts.setdefault(kind, job)
    ordered = sorted(firsts, key=lambda kind: -rows[kind])  # the largest first
    tables: list[pa.Table] = []
    total, measured, first_s = 0.0, 0, list[float]()
    with one_thread():
        for first, per_row, table, kind in _measured(sweep, [(kind, firsts[kind]) for kind in ordered]):
            first_s.append(first)
            total += per_row * rows[kind]
            measured += rows[kind]
            tables.append(table)
    # A scene's kernel is made for its rows, and again for what is drawn of a sweep's; the first one is made already.
    made = sum(1 if kind in FEW else 2 for kind, *_ in ordered)
    kernels_s = made * median(first_s[1:] or first_s)
    sample = pa.concat_tables(tables).unify_dictionaries()
    bytes_per_row = (len(encoded(sample)) - len(encoded(sample.slice(0, 1)))) / max(1, sample.num_rows - 1)
    return total * sum(rows.values()) / measured + kernels_s, bytes_per_row


def _measured(sweep: Sweep, kinds: list[tuple[_Kind, Job]]) -> Iterator[tuple[float, float, pa.Table, _Kind]]:
    """Seconds of the first design and of each other one, sampled rows and kind, until the budget is spent."""
    job = kinds[0][1]
    sweep.compute(replace(job, stop=job.start + 1))  # compiles what is not compiled yet
    begun = time.monotonic()
    for kind, job in kinds:
        few = replace(job, stop=min(job.stop, job.start + _SAMPLE))
        before = time.monotonic()
        sweep.compute(replace(job, stop=job.start + 1))  # makes the scene's kernel
        started = time.monotonic()
        table = sweep.compute(few)
        yield started - before, (time.monotonic() - started) / (few.stop - few.start), table, kind
        if time.monotonic() - begun > _BUDGET_S:
            return


def estimate_lines(found: Estimate, output: Path, more_s: float = 0.0) -> list[str]:
    """The estimate in words; `more_s`: of loading and of the report."""
    new = found.designs - found.kept
    lines = [f"{found.designs:,} designs: {found.kept:,} finished, {new:,} in {found.chunks:,} chunks to compute."]
    if new or found.evaluations:
        lines.append(
            f"About {_time(found.seconds + more_s)}, {found.memory_bytes / 2**20:,.0f} MiB of memory, "
            f"{found.disk_bytes / 2**20:,.1f} MiB of disk (half of it until the run is whole)."
        )
    if found.evaluations:
        lines.append(f"About {found.evaluations:,} evaluations of searches are in it.")
    if found.on_top:
        lines.append(f"On top of that: {', '.join(found.on_top)}.")
    return [*lines, f"Results go to {output}/; nothing was computed or written."]


def _time(seconds: float) -> str:
    if seconds < 120:
        return f"{seconds:.1f} s"
    return f"{seconds / 60:.0f} minutes" if seconds < 7200 else f"{seconds / 3600:.1f} hours"
