"""The whole run: search, sweep, front, files. What is finished survives a kill."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa

from ..constraints import FEASIBLE
from ..errors import InfeasibleError, StudyError
from ..journal import Journal, locked
from ..pareto import hypervolume
from ..progress import Progress
from ..store import (
    CURVES,
    FRONT,
    POINTS,
    PROVENANCE,
    RECOGNITION,
    RESOLVED,
    RESULTS,
    SEARCH_LOG,
    has_footer,
    write_json,
    write_table,
    write_tables,
    write_text,
)
from ..study import Study
from .compaction import Front, Gathered
from .drawn import curves_table, points_table
from .folders import begin, discard, held_by, read_facts
from .jobs import Rules, detours_of, rules_of
from .patches import recognition_table
from .planning import with_plans
from .provenance import plan_facts, provenance, resolved_yaml
from .routes import detours_in_words
from .searching import SearchAnswer, answer_row, front_table, run_search, search_facts, search_log
from .stopping import Stop, stop_on_signals
from .sweeping import Sweep
from .workers import Call, Workers, workers


@dataclass(frozen=True)
class Wishes:
    """How a run goes about failing designs.

    `fail_fast`: stop at the first one; `retry_failed`: compute the chunks again in which an earlier run had some.
    """

    fail_fast: bool = False
    retry_failed: bool = False


def run_study(
    study: Study,
    output: Path,
    n_jobs: int,
    progress: Progress,
    command: Sequence[str] = (),
    *,
    backend: str = "loky",
    scheduler: str | None = None,
    wishes: Wishes = Wishes(),
    stop: Stop | None = None,
) -> bool:
    """Run a study into `output`; what an earlier, interrupted run of the same study finished is kept.

    Writes `results.parquet`, `search.parquet` (when the study searches), `curves.parquet`, `points.parquet`,
    `recognition.parquet` (when the study asks for it), `study.resolved.yaml` and `provenance.json`, each atomically.
    Returns False when there was nothing left to do. Raises OutputError when the folder is in use, holds another study
    or cannot be written; InfeasibleError, before anything is left behind, when the search finds no feasible design;
    FailedDesignError for the first failing design, if it is wished; InterruptedRunError after SIGINT or SIGTERM, which
    are taken here unless the caller takes them into `stop`.
    """
    started = time.monotonic()
    with stop_on_signals(stop) as own, workers(Workers(n_jobs, own, backend, scheduler)) as crew, locked(output):
        held = held_by(output)
        failed = wishes.retry_failed and read_facts(output / PROVENANCE).get("failed", 0)
        if held is not None and held.finished and held.is_of(study) and not failed:
            return False
        facts = {"command": list(command), "designs": study.n_designs, "workers": crew.count, "backend": crew.backend}
        begin(output, study, facts)
        try:
            study = with_plans(study, crew.count, progress, stop=own)
        except StudyError:
            discard(output)
            raise
        run = _Run(study, output, rules_of(study), crew, progress, wishes)
        run.whole(started, command, again=held is not None)
    return True


@dataclass
class _Kept:
    """Runs calls as the crew does, and keeps each answer: what a killed search has finished is not searched again."""

    crew: Workers
    journal: Journal
    fingerprint: str
    _round: int = 0

    def __call__(self, calls: Iterable[Call]) -> Iterator[Any]:
        self._round += 1
        waiting = list(calls)
        keys = [
            hashlib.sha256(f"{self.fingerprint} answer {self._round} {at}".encode()).hexdigest()
            for at in range(len(waiting))
        ]
        known = {at: answer for at, key in enumerate(keys) if (answer := self.journal.answer(key)) is not None}
        fresh = self.crew(call for at, call in enumerate(waiting) if at not in known)
        for at, key in enumerate(keys):
            if at in known:
                yield known[at]
                continue
            started = time.monotonic()
            answer = next(fresh)
            self.journal.keep(key, answer, time.monotonic() - started)
            yield answer


@dataclass
class _Run:
    """One run of a study whose scenes are planned, in a folder that it holds."""

    study: Study
    output: Path
    rules: Rules
    crew: Workers
    progress: Progress
    wishes: Wishes
    facts: dict[str, Any] = field(default_factory=dict)

    def whole(self, started: float, command: Sequence[str], *, again: bool) -> None:
        """Search, sweep, and write everything; `again`: the folder may have this study's results already."""
        study, output = self.study, self.output
        journal = Journal(output)
        journal.check()
        sweep = Sweep(study, self.rules, journal, self.crew)
        if again and has_footer(output / RESULTS):
            sweep.refill(output / RESULTS)
        answer = self._searched(journal, sweep.fingerprint)
        gathered = Gathered(self.rules, next(iter(study.scenarios)))
        sweep.run(gathered, self.progress, fail_fast=self.wishes.fail_fast, retry_failed=self.wishes.retry_failed)
        answered = [] if answer is None else [answer_row(study, answer, self.rules, study.n_designs)]
        for row in answered:
            gathered.add(row)
        gathered.finish()
        tables = map(gathered.front.marked, chain(sweep.tables(), answered))
        write_tables(tables, self.rules.schema, output / RESULTS)
        detours = sum(map(detours_of, answered), sweep.detours)
        rows, on_front = gathered.frame(), gathered.front_frame()
        self.facts |= {
            "designs": study.n_designs + len(answered),
            "failed": sweep.failed,
            "plans": plan_facts(study),
            "trade_off": study.trade_off,
            "warnings": [*study.warnings, *sweep.warnings, *detours_in_words(detours)],
            "detours": [{"how": how, "why": why, "designs": n} for (how, why), n in detours.items()],
        }
        self._write_search(answer, gathered.swept)
        self._write_drawn(rows, on_front, answer)
        write_text(resolved_yaml(study), output / RESOLVED)
        duration = time.monotonic() - started
        write_json(provenance(study, self.crew, command, duration) | self.facts, output / PROVENANCE)
        journal.remove()

    def _searched(self, journal: Journal, mine: str) -> SearchAnswer | None:
        """The search comes first: a study that no design meets ends here, and leaves nothing."""
        if self.study.search is None:
            return None
        try:
            return run_search(self.study, self.study.search, _Kept(self.crew, journal, mine), self.progress)
        except InfeasibleError:
            journal.remove()
            discard(self.output)
            raise

    def _write_search(self, answer: SearchAnswer | None, swept: Front) -> None:
        log, trade_off = None, None
        if answer is not None:
            log = search_log(answer)
            self.facts["search"] = search_facts(self.study, answer)
            if self.study.plans[answer.search.scenario].methods.saturation == "clip":
                self.facts["warnings"].append(
                    "signals can saturate; the search sees the response before that, its row after"
                )
            if answer.front:
                trade_off = front_table(answer)
                self.facts["hypervolume"] = _hypervolumes(answer, swept)
                self.facts["hypervolume_least_sensitivity"] = answer.search.levels[0]
        self._write(SEARCH_LOG, log)
        self._write(FRONT, trade_off)

    def _write_drawn(self, rows: pd.DataFrame, on_front: pd.DataFrame, answer: SearchAnswer | None) -> None:
        self._write(CURVES, curves_table(self.study, rows, on_front, None if answer is None else answer.limit))
        self._write(POINTS, points_table(self.study, rows, on_front))
        self._write(RECOGNITION, recognition_table(self.study, rows, self.crew, self.progress))

    def _write(self, name: str, table: pa.Table | None) -> None:
        """A table, or its absence."""
        if table is None:
            (self.output / name).unlink(missing_ok=True)
        else:
            write_table(table, self.output / name)


def _hypervolumes(answer: SearchAnswer, swept: Front) -> dict[str, float]:
    """Area that the designs of sweep and search dominate above no separation and the lowest level of sensitivity."""
    reference = np.array([0.0, answer.search.levels[0] - 1e-6])
    runs = (*answer.runs, *(run for point in answer.front for run in point.runs))
    found = [[e.objective, e.sensitivity] for run in runs for e in run.log if e.violation <= FEASIBLE]
    return {
        "sweep": hypervolume(swept.points(answer.search.space.cfa, answer.search.scenario), reference),
        "search": hypervolume(np.array(found).reshape(-1, 2), reference),
    }
