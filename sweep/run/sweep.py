"""The sweep of a study: chunks over the workers, each kept as soon as it is finished."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import pyarrow as pa

from ..camera.view import View
from ..errors import FailedDesignError, Fault, OutputError
from ..results.identity import fingerprint
from ..results.journal import Journal, Shard
from ..results.tables import sliced
from ..study import Study
from ..types import Call, Progress, delayed
from .front import Gathered, few_of
from .routes import Detours
from .rows import Job, Rules, detours_of, failed_rows, job_key, jobs_of, joined, run_job, with_local_front
from .workers import WorkerKilledError, Workers, alone

KILLED = "error: its worker died twice"


@dataclass
class Sweep:
    """All chunks of a study, those that the journal holds and those that are still to compute."""

    study: Study
    rules: Rules
    journal: Journal
    crew: Workers
    warnings: list[str] = field(default_factory=list)
    failed: int = 0
    detours: Detours = field(default_factory=Counter)

    @cached_property
    def fingerprint(self) -> str:
        """What all keys depend on."""
        return fingerprint(self.study)

    @cached_property
    def jobs(self) -> list[Job]:
        """All jobs, in the order of their rows."""
        return list(jobs_of(self.study))

    @cached_property
    def keys(self) -> list[str]:
        """The key of each job."""
        return [job_key(job, self.fingerprint, self.study.plans.get(job.scenario)) for job in self.jobs]

    @cached_property
    def _views(self) -> dict[tuple[str, str, str], View]:
        return {
            (space.kind, space.name, scenario): self.study.view(space, scenario)
            for scenario in self.study.scenarios
            for space in self.study.spaces
        }

    def _view(self, job: Job) -> View:
        return self._views[job.space.kind, job.space.name, job.scenario]

    def compute(self, job: Job) -> pa.Table:
        """Rows of a job, in this process."""
        return run_job(job, self._view(job), self.rules)

    def refill(self, results: Path) -> None:
        """Take what the journal lacks out of a result table of this study, but for chunks with failed designs.

        Up to the first row that cannot be read. Not for a table in which designs took detours, which its rows do not
        tell. The whole table marks the front over all kinds of rows, a chunk its own, from which that of the swept rows
        alone follows, too.
        """
        if self.journal.entries.keys() >= set(self.keys):
            return
        chunks = sliced(results, [job.stop - job.start for job in self.jobs])
        for index, (job, key) in enumerate(zip(self.jobs, self.keys, strict=True)):
            try:
                table = next(chunks)
                if table.schema != self.rules.schema:
                    return
            except OutputError:
                return
            if key not in self.journal.entries:
                shard = Shard.of(with_local_front(table, job, self.rules), 0.0)
                if not shard.failed:
                    with self.crew.stop.held():
                        self.journal.save(key, index, shard)

    def run(self, gathered: Gathered, progress: Progress, *, fail_fast: bool, retry_failed: bool) -> None:
        """Compute what is not kept yet; `gathered` takes in all rows.

        Raises FailedDesignError, after its chunk is kept, if it is to `fail_fast`.
        """
        entries = self.journal.entries
        for index, key in enumerate(self.keys):
            if key in entries and retry_failed and entries[key].failed:
                self.journal.forget(key)
            elif key in entries and (table := self._kept(index)) is not None:
                gathered.add(few_of(table, self.rules))
        todo = [index for index, key in enumerate(self.keys) if key not in entries]
        done = sum(entries[key].rows for key in self.keys if key in entries)
        progress("designs", done, self.study.n_designs)
        calls = (delayed(_shard, self.jobs[i], self._view(self.jobs[i]), self.rules) for i in todo)

        def keep(at: int, found: tuple[Shard, pa.Table]) -> None:
            self.journal.save(self.keys[todo[at]], todo[at], found[0])

        for shard, few in self.crew(calls, _quarantined, keep):
            gathered.add(few)
            done += shard.rows
            progress("designs", done, self.study.n_designs)
            if shard.failed and fail_fast:
                raise _first_failure(shard.table())

    def tables(self) -> Iterator[pa.Table]:
        """All finished chunks in order; one whose file is damaged is computed again. Counts failures and detours."""
        self.failed, self.detours = 0, Counter()
        for index, (job, key) in enumerate(zip(self.jobs, self.keys, strict=True)):
            table = self._kept(index)
            if table is None:
                shard, _ = _shard(job, self._view(job), self.rules)
                self.journal.save(key, index, shard)
                table = shard.table()
            self.failed += self.journal.entries[key].failed
            self.detours += detours_of(table)
            yield table

    def _kept(self, index: int) -> pa.Table | None:
        """A finished chunk; None, and it counts as not finished, if its file is damaged."""
        job = self.jobs[index]
        table = self.journal.table(self.keys[index], self.rules.schema, job.stop - job.start)
        if table is None:
            self.warnings.append(f"chunk {index} was damaged on the disk and is computed again")
        return table


def _shard(job: Job, view: View, rules: Rules) -> tuple[Shard, pa.Table]:
    """A job's rows as a file's content, and the few that `Gathered` takes in."""
    started = time.monotonic()
    table = run_job(job, view, rules)
    return Shard.of(table, time.monotonic() - started), few_of(table, rules)


def _quarantined(call: Call) -> tuple[Shard, pa.Table]:
    """A job whose worker died twice: by halves, down to the design that kills, which becomes a row with its status."""
    started = time.monotonic()
    table = _halved(call)
    return Shard.of(table, time.monotonic() - started), few_of(table, call[1][2])


def _halved(call: Call) -> pa.Table:
    job, view, rules = call[1]
    if job.stop - job.start == 1:
        return failed_rows(job, rules, KILLED)
    middle = (job.start + job.stop) // 2
    tables = []
    for half in (replace(job, stop=middle), replace(job, start=middle, first_id=job.first_id + middle - job.start)):
        part: Call = (call[0], (half, view, rules), {})
        try:
            tables.append(alone(part)[0].table())
        except WorkerKilledError:
            tables.append(_halved(part))
    return joined(tables)


def _first_failure(table: pa.Table) -> FailedDesignError:
    status, ids = table["status"].to_pylist(), table["design_id"].to_pylist()
    first = next(at for at, text in enumerate(status) if text != "ok")
    return FailedDesignError(Fault(f"design {ids[first]} failed ({status[first]}); finished chunks are kept"))
