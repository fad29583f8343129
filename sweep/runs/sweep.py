"""Sweep of a study: parts on the workers, each a file of the results as soon as it is finished."""

from __future__ import annotations

import hashlib
import time
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import pyarrow as pa

from ..base.errors import FailedDesignError, ValidationIssue
from ..base.types import Call, DesignNumbers, Progress, delayed
from ..results.atomic import write_bytes
from ..results.dataset import encoded_part, part_name, read_part, refuse_others
from ..results.identity import fingerprint
from ..results.manifest import Manifest
from ..results.shown import Gathered, Selection, ShownRows, joined
from ..results.tables import word_mask
from ..study import Study
from .routes import Rules
from .rows import Job, Part, Rows, failed_rows, marked, parts_of, rows_of, rules_of, run_job, selection_of
from .workers import Held, WorkerKilledError, Workers, raise_if_stopped

_LISTED_EACH_S = 5.0
"""Time between two listings of finished parts."""
KILLED = "error: its worker died twice"
_MOST_AT_ONCE = 256
"""Rows of which all columns are computed in one call."""


@dataclass(frozen=True)
class Planned:
    """Study with the rules of its rows, what its report shows, and its fingerprint."""

    study: Study
    rules: Rules
    selection: Selection
    fingerprint: str

    @classmethod
    def of(cls, study: Study) -> Planned:
        """Return a planned study with its rules."""
        return cls(study, rules_of(study), selection_of(study), fingerprint(study))


@dataclass(frozen=True)
class FinishedPart:
    """Finished part: digest of its file, its content if the worker could not write it, and what it shows.

    `failure`: what happened to the first of the designs that failed.
    """

    digest: str
    content: bytes | None
    shown: ShownRows
    failed: int
    failure: str


@dataclass(frozen=True)
class RunOptions:
    """Failure policy."""

    fail_fast: bool = False
    retry_failed: bool = False


@dataclass
class Sweep:
    """All parts of a study, finished and remaining, in the folder of a run."""

    planned: Planned
    manifest: Manifest
    pool: Workers
    _listed_s: float = 0.0
    warnings: list[str] = field(default_factory=list)
    failed: int = 0

    def __post_init__(self) -> None:
        self.folder = self.manifest.folder.absolute()  # a worker may be elsewhere
        refuse_others(self.folder)
        self.held = self.pool.hold(self.planned, self.folder)

    @cached_property
    def parts(self) -> list[Part]:
        """All parts in the order of their rows."""
        return parts_of(self.planned.study)

    def run(self, gathered: Gathered, progress: Progress, options: RunOptions) -> None:
        """Compute the parts that are not there or not whole.

        Raises FailedDesignError if a design failed, with `fail_fast`; its part is kept.
        """
        total = self.planned.study.n_designs
        done, todo = 0, []
        for part in self.parts:
            finished = self._kept(part, options)
            if finished is None:
                todo.append(part)
            else:
                self._take(part, finished, gathered)
                done += part.size
        progress("designs", done, total)
        todo.sort(key=self._light_px, reverse=True)  # the largest lights take longest
        folder = None if self.pool.backend == "dask" else self.folder  # a cluster may have other disks
        calls = [delayed(_compute, self.held, part, folder) for part in todo]
        for at, finished in self.pool.unordered(calls, _quarantined):
            if finished.content is not None:
                write_bytes(finished.content, self.folder / part_name(todo[at].number))
            self._take(todo[at], replace(finished, content=None), gathered)
            done += todo[at].size
            if finished.failure and options.fail_fast:
                self._list()
                raise FailedDesignError(ValidationIssue(f"{finished.failure}; finished parts are kept"))
            progress("designs", done, total)
        self._list()

    def _light_px(self, part: Part) -> float:
        target = self.planned.study.scenarios[part.jobs[0].scenario].target
        return 0.0 if target is None else target.object_resolution_px

    def _take(self, part: Part, finished: FinishedPart, gathered: Gathered) -> None:
        self.manifest.files[part_name(part.number)] = finished.digest
        if finished.failed and not self.failed:
            self.warnings.append(f"{finished.failure}: not in the report")
        self.failed += finished.failed
        gathered.add(finished.shown)
        if time.monotonic() - self._listed_s > _LISTED_EACH_S:
            self._list()

    def _list(self) -> None:
        """List finished parts; of those after the last listing, their own checksums tell whether they are whole."""
        self.manifest.save()
        self._listed_s = time.monotonic()

    def _kept(self, part: Part, options: RunOptions) -> FinishedPart | None:
        """Return a part of an earlier run; None if it is not there, or not as that run wrote it."""
        name, planned = part_name(part.number), self.planned
        path, listed = self.folder / name, self.manifest.files.get(name)
        if listed is None and not path.is_file():
            return None
        stored = read_part(path, part.key(planned.fingerprint), planned.rules.schema, part.size)
        if stored is None or listed not in (None, stored[1]):
            self.warnings.append(f"part {part.number} was damaged on the disk and is computed again")
            return None
        table, digest = stored
        if options.retry_failed and _failures(table)[0]:
            return None
        shown = planned.selection.of_part(marked(table, part, planned.study, planned.rules))
        return FinishedPart(digest, None, shown, *_failures(table))

    def write_answers(self, rows: pa.Table, gathered: Gathered) -> None:
        """Write the answers of a search, after all designs."""
        part, planned = Part(len(self.parts), ()), self.planned
        finished = _written(planned, part, self.folder, rows.select(planned.rules.wanted_of_swept.schema.names))
        self._take(part, finished, gathered)
        self._list()

    def with_all_columns(self, rows: pa.Table) -> pa.Table:
        """Return rows of the parts with all columns of what a report shows; rows that fail stay as they are."""
        shown = self.planned.rules.shown
        if rows.schema.names == shown.names:
            return rows
        ok = word_mask(rows, "status", "ok")
        ids, jobs, calls = rows["design_id"].to_numpy()[ok], [job for part in self.parts for job in part.jobs], []
        of_job = np.searchsorted([job.first_id for job in jobs], ids, side="right") - 1
        for at in np.unique(of_job):
            ids_of_job = ids[of_job == at]
            for start in range(0, ids_of_job.size, _MOST_AT_ONCE):
                calls.append(delayed(_all_columns, self.held, jobs[at], ids_of_job[start : start + _MOST_AT_ONCE]))
        tables = [table.filter(pa.array(word_mask(table, "status", "ok"))) for table in self.pool(calls)]
        computed = np.concatenate([table["design_id"].to_numpy() for table in tables] or [ids[:0]])
        if lost := ids.size - computed.size:
            self.warnings.append(
                f"{lost} designs of the report have not all columns: a quantity beside those asked for fails"
            )
        others = rows.filter(pa.array(~np.isin(rows["design_id"].to_numpy(), computed)))
        return joined([*tables, others], shown)


def _compute(held: Held, part: Part, folder: Path | None) -> FinishedPart:
    """Compute a part, and write it if a folder is given."""
    planned = held.value
    tables = [run_job(job, planned.study, planned.rules) for job in part.jobs]
    return _written(planned, part, folder, pa.concat_tables(tables).unify_dictionaries())


def _written(planned: Planned, part: Part, folder: Path | None, table: pa.Table) -> FinishedPart:
    raise_if_stopped()
    schema = planned.rules.schema
    rows = table.select(schema.names).replace_schema_metadata(schema.metadata)
    content = encoded_part(rows, part.key(planned.fingerprint))
    if folder is not None:
        write_bytes(content, folder / part_name(part.number))
    digest = hashlib.sha256(content).hexdigest()
    shown = planned.selection.of_part(table)
    return FinishedPart(digest, content if folder is None else None, shown, *_failures(table))


def _all_columns(held: Held, job: Job, ids: DesignNumbers) -> pa.Table:
    """Compute all columns of some designs of a job."""
    study, rules = held.value.study, held.value.rules
    numbers = ids - job.first_id + job.start
    at = Rows(study.spaces[job.space], job.scenario, numbers, ids, ids - job.first_id + job.first_filter)
    return rows_of(at, study.setup(at.space, job.scenario), rules, rules.wanted)


def _failures(table: pa.Table) -> tuple[int, str]:
    """Return how many designs failed, and what happened to the first one."""
    failed = table.select(["design_id", "status"]).filter(pa.array(~word_mask(table, "status", "ok")))
    texts = [f"design {row['design_id']} failed ({row['status']})" for row in failed.slice(0, 1).to_pylist()]
    return failed.num_rows, "".join(texts)


def _quarantined(call: Call) -> FinishedPart:
    """Compute a part whose worker died twice job by job; one that kills again by halves, down to the design."""
    held, part, folder = call[1]
    tables = [_alone(job, held) for job in part.jobs]
    return _written(held.value, part, folder, pa.concat_tables(tables).unify_dictionaries())


def _alone(job: Job, held: Held) -> pa.Table:
    """Return the rows of a job, computed with no other; by halves if its worker dies, down to a row with its status."""
    try:
        table: pa.Table = Workers(2).alone((_rows_of_job, (job, held), {}))
        return table
    except WorkerKilledError:
        if job.size == 1:
            return failed_rows(job, held.value.study, held.value.rules, KILLED)
    first = job.size // 2
    middle = job.start + first
    second = replace(job, start=middle, first_id=job.first_id + first, first_filter=job.first_filter + first)
    halves = [_alone(half, held) for half in (replace(job, stop=middle), second)]
    return pa.concat_tables(halves).unify_dictionaries()


def _rows_of_job(job: Job, held: Held) -> pa.Table:
    return run_job(job, held.value.study, held.value.rules)
