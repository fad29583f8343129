"""Sweep of a study: jobs on the workers, each kept as a part file as soon as it is finished."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import groupby
from pathlib import Path

import numpy as np
import pyarrow as pa

from ..base.errors import FailedDesignError, ValidationIssue
from ..base.types import Call, Progress, delayed
from ..camera.setup import Setup
from ..results.identity import fingerprint
from ..results.parts import ROWS, Parts, write_part
from ..results.tables import decoded, encoded, word_mask
from ..study import Study
from .front import RunRows, report_rows
from .routes import Rules
from .rows import Job, failed_rows, job_key, jobs_of, run_job
from .workers import WorkerKilledError, Workers, raise_if_stopped

_SCENES_PER_WORKER, _FEW = 2, 64
"""Least number of scenes for each worker, and largest number of designs, where one worker computes a whole scene."""
KILLED = "error: its worker died twice"
_KeyedJob = tuple[Job, str, Setup]
"""A job, its key and its setup."""


@dataclass(frozen=True)
class FinishedJob:
    """Finished job.

    `part`: name of its part file, or its content if the worker could not write it.
    """

    part: str | bytes
    named_rows: pa.Table
    failed: int


@dataclass(frozen=True)
class RunOptions:
    """Failure policy."""

    fail_fast: bool = False
    retry_failed: bool = False


@dataclass
class Sweep:
    """All jobs of a study, finished and remaining."""

    study: Study
    rules: Rules
    parts: Parts
    pool: Workers
    warnings: list[str] = field(default_factory=list)
    failed: int = 0

    @cached_property
    def fingerprint(self) -> str:
        """Fingerprint of the study, part of all keys."""
        return fingerprint(self.study)

    @cached_property
    def jobs(self) -> list[Job]:
        """All jobs in the order of their rows."""
        return list(jobs_of(self.study))

    @cached_property
    def keys(self) -> list[str]:
        """Key of each job."""
        return [job_key(job, self.fingerprint, self.study.plans.get(job.scenario)) for job in self.jobs]

    @property
    def todo(self) -> list[int]:
        """Jobs without a part."""
        return [index for index, key in enumerate(self.keys) if key not in self.parts]

    @cached_property
    def _setups(self) -> dict[tuple[int, str], Setup]:
        spaces, scenarios = self.study.spaces, self.study.scenarios
        return {(id(space), name): self.study.setup(space, name) for name in scenarios for space in spaces}

    def _setup(self, job: Job) -> Setup:
        return self._setups[id(job.space), job.scenario]

    def run(self, gathered: RunRows, progress: Progress, options: RunOptions) -> None:
        """Compute the remaining jobs.

        Raises FailedDesignError if a design failed, with `fail_fast`; its part is kept.
        """
        done = 0
        for index, key in enumerate(self.keys):
            if key in self.parts and (table := self._kept(index)) is not None:
                failed = _failed(table)
                if options.retry_failed and failed:
                    self.parts.forget(key)
                    continue
                self.failed += failed
                gathered.add(report_rows(table, self.rules))
                done += table.num_rows
        progress("designs", done, self.study.n_designs)
        batches = self._batches(self.todo)
        folder = None if self.pool.backend == "dask" else self.parts.folder  # a cluster may have other disks
        keyed = ([(self.jobs[i], self.keys[i], self._setup(self.jobs[i])) for i in batch] for batch in batches)
        calls = [delayed(_compute, jobs, self.rules, folder) for jobs in keyed]
        for at, results in self.pool.unordered(calls, _quarantined):
            for index, finished in zip(batches[at], results, strict=True):
                if isinstance(finished.part, str):
                    self.parts.add(finished.part)
                else:
                    self.parts.save(self.keys[index], ROWS, finished.part)
                self.failed += finished.failed
                gathered.add(finished.named_rows)
                done += self.jobs[index].size
                if finished.failed and options.fail_fast:
                    raise _first_failure(self.table(index))
            progress("designs", done, self.study.n_designs)

    def tables(self) -> Iterator[pa.Table]:
        """Yield the rows of all jobs in order."""
        for index in range(len(self.jobs)):
            yield self.table(index)

    def table(self, index: int) -> pa.Table:
        """Return the rows of a finished job; a damaged part is computed again."""
        job, table = self.jobs[index], self._kept(index)
        return run_job(job, self._setup(job), self.rules) if table is None else table

    def _kept(self, index: int) -> pa.Table | None:
        """Return the rows of a part; None, and a warning, if it is damaged."""
        content = self.parts.read(self.keys[index])
        table = None if content is None else decoded(content, self.rules.schema, self.jobs[index].size)
        if table is None:
            self.warnings.append(f"part {index} was damaged on the disk and is computed again")
            self.parts.forget(self.keys[index])
        return table

    def _batches(self, todo: list[int]) -> list[list[int]]:
        """Return jobs by the call that computes them.

        Jobs of few designs of one scene share its pixel response in one worker, if there are enough scenes. Scenes
        with the largest lights, which take longest, come first.
        """

        def light_px(scenario: str) -> float:
            target = self.study.scenarios[scenario].target
            return 0.0 if target is None else target.object_resolution_px

        scenes = [list(jobs) for _, jobs in groupby(todo, lambda index: self.jobs[index].scenario)]
        scenes.sort(key=lambda jobs: -light_px(self.jobs[jobs[0]].scenario))
        enough = len(scenes) >= _SCENES_PER_WORKER * self.pool.count
        batches: list[list[int]] = []
        for jobs in scenes:
            is_small = sum(self.jobs[index].size for index in jobs) <= _FEW
            batches += [jobs] if enough and is_small else [[index] for index in jobs]
        return batches


def _compute(jobs: Sequence[_KeyedJob], rules: Rules, folder: Path | None) -> list[FinishedJob]:
    """Compute jobs, and write their parts if a folder is given."""
    return [_finished(key, folder, rules, run_job(job, setup, rules)) for job, key, setup in jobs]


def _finished(key: str, folder: Path | None, rules: Rules, table: pa.Table) -> FinishedJob:
    raise_if_stopped()
    content = encoded(table)
    part = content if folder is None else write_part(folder, key, ROWS, content)
    return FinishedJob(part, report_rows(table, rules), _failed(table))


def _failed(table: pa.Table) -> int:
    return int(np.count_nonzero(~word_mask(table, "status", "ok")))


def _quarantined(call: Call) -> list[FinishedJob]:
    """Compute jobs whose worker died twice one by one; one that kills again by halves, down to the design."""
    jobs, rules, folder = call[1]
    return [_finished(key, folder, rules, _alone(job, setup, rules)) for job, key, setup in jobs]


def _alone(job: Job, setup: Setup, rules: Rules) -> pa.Table:
    """Return the rows of a job, computed with no other; by halves if its worker dies, down to a row with its status."""
    try:
        table: pa.Table = Workers(2).alone((run_job, (job, setup, rules), {}))
        return table
    except WorkerKilledError:
        if job.size == 1:
            return failed_rows(job, rules, KILLED)
    first = job.size // 2
    middle = job.start + first
    second = replace(job, start=middle, first_id=job.first_id + first, first_filter=job.first_filter + first)
    halves = [_alone(half, setup, rules) for half in (replace(job, stop=middle), second)]
    return pa.concat_tables(halves).unify_dictionaries()


def _first_failure(table: pa.Table) -> FailedDesignError:
    row = table.filter(pa.array(~word_mask(table, "status", "ok"))).slice(0, 1).to_pylist()[0]
    return FailedDesignError(
        ValidationIssue(f"design {row['design_id']} failed ({row['status']}); finished parts are kept")
    )
