"""The sweep of a study: jobs over the workers, each kept as a part as soon as it is finished."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import groupby
from pathlib import Path

import numpy as np
import pyarrow as pa

from ..base.errors import FailedDesignError, Fault
from ..base.types import Call, Progress, delayed
from ..camera.setup import Setup
from ..results.identity import fingerprint
from ..results.parts import ROWS, Parts, write_part
from ..results.tables import decoded, encoded, holds
from ..study import Study
from .front import Gathered, few_of
from .rows import Job, Rules, failed_rows, job_key, jobs_of, joined, run_job, spent_on
from .workers import WorkerKilledError, Workers, heed_stop

_SCENES_PER_WORKER, _FEW = 2, 64
"""From how many scenes for each worker on, and up to how many designs, one worker computes all jobs of a scene."""
KILLED = "error: its worker died twice"
_FACTS = b"cfa_sweep_part"
"""Metadata of a part: its failed designs and the seconds that it took."""


@dataclass(frozen=True)
class Finished:
    """A finished job: its part, and what a run keeps of its rows in memory.

    `part`: the name of its file, or its content where the worker could not write it; `few`: see `few_of`.
    """

    part: str | bytes
    few: pa.Table
    failed: int
    seconds: float


@dataclass(frozen=True)
class RunOptions:
    """Settings for designs that fail.

    `fail_fast`: stop at the first one; `retry_failed`: compute a finished run again in which some failed.
    """

    fail_fast: bool = False
    retry_failed: bool = False


@dataclass
class Sweep:
    """All jobs of a study, those that are kept and those that are still to compute.

    `failed`, `seconds`, `spent_s`: designs that failed, seconds of the workers for all rows, and of these for metrics
    of the whole readout.
    """

    study: Study
    rules: Rules
    parts: Parts
    crew: Workers
    warnings: list[str] = field(default_factory=list)
    failed: int = 0
    seconds: float = 0.0
    spent_s: float = 0.0

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
    def _setups(self) -> dict[tuple[str, str, str], Setup]:
        return {
            (space.kind, space.name, scenario): self.study.setup(space, scenario)
            for scenario in self.study.scenarios
            for space in self.study.spaces
        }

    def _setup(self, job: Job) -> Setup:
        return self._setups[job.space.kind, job.space.name, job.scenario]

    @property
    def todo(self) -> list[int]:
        """Jobs without a part."""
        return [index for index, key in enumerate(self.keys) if key not in self.parts]

    def run(self, gathered: Gathered, progress: Progress, options: RunOptions) -> None:
        """Compute what is not kept yet; `gathered` takes in all rows.

        Raises FailedDesignError, after its part is kept, where the options ask for it.
        """
        done = 0
        for index, key in enumerate(self.keys):
            if key in self.parts and (table := self._kept(index)) is not None:
                facts = json.loads(table.schema.metadata[_FACTS])
                if options.retry_failed and facts["failed"]:
                    self.parts.forget(key)
                    continue
                self._take_in(Finished("", few_of(table, self.rules), **facts), gathered)
                done += table.num_rows
        progress("designs", done, self.study.n_designs)
        batches = self._batches(self.todo)
        folder = None if self.crew.backend == "dask" else self.parts.folder  # a cluster may have other disks
        asked = ([(self.jobs[i], self.keys[i], self._setup(self.jobs[i])) for i in batch] for batch in batches)
        calls = [delayed(_compute, jobs, self.rules, folder) for jobs in asked]
        for at, results in self.crew.unordered(calls, _quarantined):
            for index, finished in zip(batches[at], results, strict=True):
                if isinstance(finished.part, str):
                    self.parts.add(finished.part)
                else:
                    self.parts.save(self.keys[index], ROWS, finished.part)
                self._take_in(finished, gathered)
                done += self.jobs[index].stop - self.jobs[index].start
                if finished.failed and options.fail_fast:
                    raise _first_failure(self.table(index))
            progress("designs", done, self.study.n_designs)

    def tables(self) -> Iterator[pa.Table]:
        """The rows of all jobs, in their order."""
        for index in range(len(self.jobs)):
            yield self.table(index)

    def table(self, index: int) -> pa.Table:
        """The rows of a finished job; one whose part was damaged since is computed again."""
        table = self._kept(index)
        if table is None:
            job = self.jobs[index]
            table = run_job(job, self._setup(job), self.rules)
        return table

    def _kept(self, index: int) -> pa.Table | None:
        """The rows of a part; None, and a warning, where it is damaged."""
        job, content = self.jobs[index], self.parts.read(self.keys[index])
        table = None if content is None else decoded(content, self.rules.schema, job.stop - job.start)
        if table is None or _FACTS not in table.schema.metadata:
            self.warnings.append(f"part {index} was damaged on the disk and is computed again")
            self.parts.forget(self.keys[index])
            return None
        return table

    def _batches(self, todo: list[int]) -> list[list[int]]:
        """Jobs by the calls that they are computed in.

        Jobs of few designs of one scene go to one worker, since they share its pixel responses, where there are so many
        scenes that no worker waits long for the last one. Scenes with the largest lights, which take longest, come
        first.
        """
        scenes = [list(own) for _, own in groupby(todo, lambda index: self.jobs[index].scenario)]
        scenes.sort(key=lambda own: -self._light_px(self.jobs[own[0]].scenario))
        enough = len(scenes) >= _SCENES_PER_WORKER * self.crew.count
        batches: list[list[int]] = []
        for own in scenes:
            few = sum(self.jobs[index].stop - self.jobs[index].start for index in own) <= _FEW
            batches += [own] if enough and few else [[index] for index in own]
        return batches

    def _light_px(self, scenario: str) -> float:
        """Size of a scene's light on the mosaic, pixels; 0 where it fills the field."""
        target = self.study.scenarios[scenario].target
        return 0.0 if target is None else target.object_resolution_px

    def _take_in(self, finished: Finished, gathered: Gathered) -> None:
        self.failed += finished.failed
        self.seconds += finished.seconds
        self.spent_s += spent_on(finished.few)
        gathered.add(finished.few)


_Asked = tuple[Job, str, Setup]
"""A job, its key and its setup."""


def _compute(asked: Sequence[_Asked], rules: Rules, folder: Path | None) -> list[Finished]:
    """Compute jobs, and write their parts where a folder is given."""
    return [_finished(key, folder, rules, partial(run_job, job, setup, rules)) for job, key, setup in asked]


def _finished(key: str, folder: Path | None, rules: Rules, compute: Callable[[], pa.Table]) -> Finished:
    started = time.monotonic()
    table = compute()
    heed_stop()
    failed = int(np.count_nonzero(~holds(table, "status", "ok")))
    seconds = round(time.monotonic() - started, 4)
    facts = json.dumps({"failed": failed, "seconds": seconds}).encode()
    content = encoded(table.replace_schema_metadata({**(table.schema.metadata or {}), _FACTS: facts}))
    part = content if folder is None else write_part(folder, key, ROWS, content)
    return Finished(part, few_of(table, rules), failed, seconds)


def _quarantined(call: Call) -> list[Finished]:
    """Jobs whose worker died twice, one by one; one that kills again by halves, down to the design that does."""
    asked, rules, folder = call[1]
    again = _halved if len(asked) == 1 else _alone
    return [_finished(key, folder, rules, partial(again, job, setup, rules)) for job, key, setup in asked]


def _alone(job: Job, setup: Setup, rules: Rules) -> pa.Table:
    """Rows of a job, with no other under way; by halves where its worker dies."""
    try:
        table: pa.Table = Workers(2).alone((run_job, (job, setup, rules), {}))
        return table
    except WorkerKilledError:
        return _halved(job, setup, rules)


def _halved(job: Job, setup: Setup, rules: Rules) -> pa.Table:
    """Rows of a job that kills its worker; a single design is a row with its status."""
    if job.stop - job.start == 1:
        return failed_rows(job, rules, KILLED)
    middle = (job.start + job.stop) // 2
    first = middle - job.start
    second = replace(job, start=middle, first_id=job.first_id + first, first_filter=job.first_filter + first)
    halves = replace(job, stop=middle), second
    return joined([_alone(half, setup, rules) for half in halves])


def _first_failure(table: pa.Table) -> FailedDesignError:
    status, ids = table["status"].to_pylist(), table["design_id"].to_pylist()
    first = next(at for at, text in enumerate(status) if text != "ok")
    return FailedDesignError(Fault(f"design {ids[first]} failed ({status[first]}); finished parts are kept"))
