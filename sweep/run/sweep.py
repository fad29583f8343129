"""The sweep of a study: chunks over the workers, each kept as soon as it is finished."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import groupby
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from ..base.errors import FailedDesignError, Fault, OutputError
from ..base.types import Call, IndexArray, Progress, delayed
from ..camera.setup import Setup
from ..results.identity import fingerprint
from ..results.joined import Joining, RowsPart
from ..results.journal import Entry, Journal, Shard
from ..results.tables import sliced
from ..study import Study
from .front import Gathered, few_of
from .looks import Look, Looking
from .routes import Detours
from .rows import Job, Rules, detours_of, failed_rows, job_key, jobs_of, joined, run_job, spent_on, with_local_front
from .wishes import Wishes
from .workers import WorkerKilledError, Workers, alone

_SCENES_PER_WORKER, _FEW = 2, 64
"""From how many scenes for each worker on, and up to how many designs, one worker computes all jobs of a scene."""
KILLED = "error: its worker died twice"
_Finished = tuple[Shard, pa.Table, dict[int, Look]]
"""A job's rows as a file, the few that `Gathered` takes in, and looks at its designs by their ids."""
_Asked = tuple[Job, Setup, Path | None]
"""A job, its setup, and beside which path its rows are to be hidden; None: they come back as bytes."""


@dataclass
class Sweep:
    """All chunks of a study, those that the journal holds and those that are still to compute.

    `looking`: how plain CFAs and named designs are looked at while they are computed; `looks`: what was seen.
    `spent_s`: of `seconds` that all rows took, those of metrics of the whole readout.
    """

    study: Study
    rules: Rules
    journal: Journal
    crew: Workers
    looking: Looking | None = None
    warnings: list[str] = field(default_factory=list)
    failed: int = 0
    detours: Detours = field(default_factory=Counter)
    seconds: float = 0.0
    spent_s: float = 0.0
    looks: dict[int, Look] = field(default_factory=dict)

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

    def compute(self, job: Job) -> pa.Table:
        """Rows of a job, in this process."""
        return run_job(job, self._setup(job), self.rules)

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

    def run(self, gathered: Gathered, whole: Joining, progress: Progress, wishes: Wishes) -> None:
        """Compute what is not kept yet; `gathered` and `whole` take in all rows, the latter in their order.

        Raises FailedDesignError, after its chunk is kept, if that is wished. Counts failures and detours.
        """
        self.failed, self.detours, self.seconds, self.spent_s = 0, Counter(), 0.0, 0.0
        entries = self.journal.entries
        in_order = _InOrder(self, whole)
        for index, key in enumerate(self.keys):
            if key in entries and wishes.retry_failed and entries[key].failed:
                self.journal.forget(key)
            elif key in entries and (table := self._kept(index)) is not None:
                few = few_of(table, self.rules)
                self._take_in(few, entries[key], gathered)
                in_order.found(index, few, waits=True)
        todo = [index for index, key in enumerate(self.keys) if key not in entries]
        done = sum(entries[key].rows for key in self.keys if key in entries)
        progress("designs", done, self.study.n_designs)
        batches = self._batches(todo)
        asked = ([(self.jobs[i], self._setup(self.jobs[i]), self._path(i)) for i in batch] for batch in batches)
        calls = (delayed(_shards, batch, self.rules, self.looking) for batch in asked)

        def keep(at: int, found: list[_Finished]) -> None:
            for index, (shard, *_) in zip(batches[at], found, strict=True):
                self.journal.save(self.keys[index], index, shard)

        with closing(self.crew(calls, _quarantined, keep)) as finished:
            for batch, found in zip(batches, finished, strict=True):
                for index, (shard, few, looks) in zip(batch, found, strict=True):
                    self._take_in(few, shard, gathered)
                    self.looks |= looks
                    done += shard.rows
                    if shard.failed and wishes.fail_fast:
                        raise _first_failure(pq.read_table(pa.BufferReader(self.content(index, just_kept=True))))
                    in_order.found(index, few)
                progress("designs", done, self.study.n_designs)
        in_order.rest()

    def _batches(self, todo: list[int]) -> list[list[int]]:
        """Jobs by the calls that they are computed in.

        Jobs of few designs of one scene go to one worker, since they share its kernels, where there are so many scenes
        that no worker waits long for the last one. Scenes with the largest lights, which take longest, come first.
        """
        scenes = [list(own) for _, own in groupby(todo, lambda index: self.jobs[index].scenario)]
        scenes.sort(key=lambda own: -self._light_px(self.jobs[own[0]].scenario))
        if len(scenes) < _SCENES_PER_WORKER * self.crew.count:
            return [[index] for own in scenes for index in own]
        found: list[list[int]] = []
        for own in scenes:
            few = sum(self.jobs[index].stop - self.jobs[index].start for index in own) <= _FEW
            found += [own] if few else [[index] for index in own]
        return found

    def _light_px(self, scenario: str) -> float:
        """Size of a scene's light on the mosaic, pixels; 0 where it fills the field."""
        target = self.study.scenarios[scenario].target
        return 0.0 if target is None else target.object_resolution_px

    def _path(self, index: int) -> Path | None:
        """Beside which path a worker writes the rows of a job; None on a cluster, where disks are not shared."""
        return None if self.crew.backend == "dask" else self.journal.path(self.keys[index], index)

    def content(self, index: int, *, just_kept: bool = False) -> bytes:
        """A finished chunk as a file; one whose file was damaged since is computed again."""
        job, key = self.jobs[index], self.keys[index]
        content = self.journal.content(key, just_kept=just_kept)
        if content is None:
            self._tell_damaged(index)
            shard, *_ = _finished((job, self._setup(job), None), self.rules, partial(self.compute, job))
            self.journal.save(key, index, shard)
            assert isinstance(shard.file, bytes)
            content = shard.file
        return content

    def _kept(self, index: int) -> pa.Table | None:
        """A finished chunk; None, and it counts as not finished, if its file is damaged."""
        job = self.jobs[index]
        table = self.journal.table(self.keys[index], self.rules.schema, job.stop - job.start)
        if table is None:
            self._tell_damaged(index)
        return table

    def _tell_damaged(self, index: int) -> None:
        self.warnings.append(f"chunk {index} was damaged on the disk and is computed again")

    def _take_in(self, few: pa.Table, finished: Entry | Shard, gathered: Gathered) -> None:
        """A finished chunk, of which `few_of` gives these rows."""
        self.failed += finished.failed
        self.detours += detours_of(few)
        self.seconds += finished.seconds
        self.spent_s += spent_on(few)
        gathered.add(few)


@dataclass
class _InOrder:
    """The finished chunks of a sweep, in the order of their rows, on their way to the whole table.

    One whose turn is not yet is read from the journal later; of its rows, those are kept that may be on the front.
    """

    sweep: Sweep
    whole: Joining
    early: dict[int, tuple[pa.Table, IndexArray]] = field(default_factory=dict)
    turn: int = 0

    def found(self, index: int, few: pa.Table, *, waits: bool = False) -> None:
        """A chunk is finished, of which `few_of` gives these rows; unless it `waits`, it may go on if it is its turn.

        So may one more that came before its turn. A stop waits for no more of them.
        """
        marked = few.filter(few["pareto"])
        at = marked["design_id"].to_numpy() - self.sweep.jobs[index].first_id
        self.early[index] = marked.select(self.whole.needs), at
        if not waits:
            if index == self.turn:
                self._join(just_kept=True)
            if self.turn in self.early:
                self._join()

    def rest(self) -> None:
        """All are finished."""
        while self.turn in self.early:
            self._join()

    def _join(self, *, just_kept: bool = False) -> None:
        job, content = self.sweep.jobs[self.turn], self.sweep.content(self.turn, just_kept=just_kept)
        self.whole.add(RowsPart(content, job.stop - job.start, *self.early.pop(self.turn)))
        self.turn += 1


def _shards(batch: Sequence[_Asked], rules: Rules, looking: Looking | None) -> list[_Finished]:
    """What is found of each job."""
    return [_finished(asked, rules, partial(run_job, *asked[:2], rules), looking) for asked in batch]


def _finished(
    asked: _Asked, rules: Rules, computed: Callable[[], pa.Table], looking: Looking | None = None
) -> _Finished:
    """A job's rows, once they are computed."""
    job, setup, path = asked
    started = time.monotonic()
    table = computed()
    shard = Shard.of(table, time.monotonic() - started, path)
    return shard, few_of(table, rules), {} if looking is None else looking.beside_rows(job, setup, table)


def _quarantined(call: Call) -> list[_Finished]:
    """Jobs whose worker died twice: one by one, and of those that kill again by halves, down to the design that does,
    which becomes a row with its status. None of them is looked at.
    """
    batch, rules, _ = call[1]
    again = _halved if len(batch) == 1 else _table_alone
    return [_finished((job, setup, None), rules, partial(again, job, setup, rules)) for job, setup, _ in batch]


def _table_alone(job: Job, setup: Setup, rules: Rules) -> pa.Table:
    """Rows of a job, in a process of its own; by halves if that dies."""
    try:
        table: pa.Table = alone((run_job, (job, setup, rules), {}))
        return table
    except WorkerKilledError:
        return _halved(job, setup, rules)


def _halved(job: Job, setup: Setup, rules: Rules) -> pa.Table:
    """Rows of a job that kills its worker."""
    if job.stop - job.start == 1:
        return failed_rows(job, rules, KILLED)
    middle = (job.start + job.stop) // 2
    first = middle - job.start
    second = replace(job, start=middle, first_id=job.first_id + first, first_filter=job.first_filter + first)
    halves = replace(job, stop=middle), second
    return joined([_table_alone(half, setup, rules) for half in halves])


def _first_failure(table: pa.Table) -> FailedDesignError:
    status, ids = table["status"].to_pylist(), table["design_id"].to_pylist()
    first = next(at for at, text in enumerate(status) if text != "ok")
    return FailedDesignError(Fault(f"design {ids[first]} failed ({status[first]}); finished chunks are kept"))
