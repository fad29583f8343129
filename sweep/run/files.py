"""The files of a run, each made from what it needs: all of them, or those that are missing or damaged."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from ..base.errors import BrokenProofError
from ..base.types import Progress
from ..metrics.bound import FEASIBLE
from ..metrics.pareto import hypervolume
from ..metrics.whole_readout import whole_readout_metrics
from ..results.dictionary import described
from ..results.facts import Provenance
from ..results.inventory import Inventory
from ..results.joined import RowsPart, joining
from ..results.journal import Journal
from ..results.names import TABLES
from ..results.tables import (
    FRONT,
    LEFT_OUT,
    PROVENANCE,
    RESOLVED,
    RESULTS,
    SEARCH_LOG,
    VISION_TABLES,
    holds,
    json_of,
    sliced,
)
from ..results.thinning import swept_points
from ..search.limit import Limit
from ..study import Study
from .answers import Kept
from .check import check_run
from .front import Front, Gathered, few_of
from .held_out import left_out_table
from .looks import Looking, looks_of
from .of_rows import ROW_TABLES, Shown
from .provenance import plan_facts, provenance, resolved_yaml
from .routes import Detours, detours_in_words, spent_in_words
from .rows import Rules, detours_of, with_local_front
from .search import (
    SearchAnswer,
    answer_row,
    front_table,
    limit_alone,
    run_search,
    search_facts,
    search_log,
)
from .sweep import Sweep
from .wishes import Wishes
from .workers import Workers

_CHECK_S, _CHECK_SHARE = 1.0, 0.1
"""Time of the check at the end of a run: seconds, or a share of the run, whichever is longer."""


def files_of(study: Study) -> set[str]:
    """Names of the files that a run of the study makes."""
    names = {RESULTS, RESOLVED, PROVENANCE, *(name for name, table in ROW_TABLES.items() if table.asked(study))}
    if study.search is not None:
        names |= {SEARCH_LOG, FRONT} if study.search.levels else {SEARCH_LOG}
    names |= {LEFT_OUT} if study.leaves_one_out else set()
    return names | ({*VISION_TABLES} if study.section.vision is not None else set())


@dataclass
class Making:
    """One run of a study whose scenes are planned, in a folder that it holds.

    `started`: when the run began, by the monotonic clock, seconds; `then_load`: see `run_study`.
    """

    study: Study
    rules: Rules
    inventory: Inventory
    crew: Workers
    progress: Progress
    wishes: Wishes
    started: float
    then_load: Sequence[str]
    made: set[str] = field(default_factory=set)
    _failed: int = 0
    _aside: Executor = field(init=False)
    _table: Future[None] | None = None
    _warnings: list[str] = field(default_factory=list)

    def make(self, names: set[str]) -> None:
        """Make these files; where a table comes out other than it was listed, all others, too.

        Provenance comes last: what a folder without it holds is not a finished run.
        """
        with ThreadPoolExecutor(1) as self._aside:
            self._make(names)

    def _make(self, names: set[str]) -> None:
        before = dict(self.inventory.files)
        todo = names
        while todo:
            if RESULTS in todo:
                self._sweep()
            if todo & {SEARCH_LOG, FRONT, LEFT_OUT}:
                self._wait_for_table()
                self._write_search(todo)
            if todo & ROW_TABLES.keys():
                self._write_of_rows(todo)
            self._wait_for_table()
            if todo & {*VISION_TABLES}:
                self._write_vision(todo)
            if RESOLVED in todo:
                self.inventory.write({RESOLVED: resolved_yaml(self.study).encode("utf-8")})
            if PROVENANCE in todo:
                self.inventory.write({PROVENANCE: json_of(self._provenance().model_dump(mode="json")).encode("utf-8")})
            self.made |= todo
            changed = {n for n in self.made if before.get(n) != self.inventory.files[n]}
            todo = files_of(self.study) - self.made if changed & {*TABLES} else set()
        if changed:
            self.inventory.outdate(rows=bool(changed & {*TABLES}))
        self.journal.remove()

    @cached_property
    def journal(self) -> Journal:
        """What an interrupted run has kept."""
        journal = Journal(self.inventory.folder)
        journal.check()
        return journal

    @cached_property
    def sweep(self) -> Sweep:
        """The chunks of the study."""
        return Sweep(self.study, self.rules, self.journal, self.crew, Looking.of(self.study, files_of(self.study)))

    @cached_property
    def answer(self) -> SearchAnswer | None:
        """The search's, which comes first: a study that no design meets ends here."""
        if self.study.search is None:
            return None
        parallel = Kept(self.crew, self.journal, self.sweep.fingerprint)
        try:
            return run_search(self.study, self.study.search, parallel, self.progress)
        except BrokenProofError:
            parallel.drop_limits()
            raise

    @cached_property
    def gathered(self) -> Gathered:
        """What is drawn of the rows, out of the result table, which is as it was written."""
        gathered = self._gathering()
        sizes = [job.stop - job.start for job in self.sweep.jobs]
        path = self.inventory.path(RESULTS)
        parts = sliced(path, sizes if self.study.search is None else [*sizes, 1])
        for job, table in zip(self.sweep.jobs, parts, strict=False):
            self._failed += int(np.count_nonzero(~holds(table, "status", "ok")))
            gathered.add(few_of(with_local_front(table, job, self.rules), self.rules))
        for row in parts:  # the search's answer
            gathered.add(row.set_column(row.schema.get_field_index("pareto"), "pareto", pa.array([True])))
        gathered.finish()
        return gathered

    def _gathering(self) -> Gathered:
        return Gathered(self.rules, next(iter(self.study.scenarios)))

    def _sweep(self) -> None:
        """Search and sweep, and write the result table."""
        results = self.inventory.path(RESULTS)
        intact = RESULTS in self.inventory.files and not self.inventory.wrong([RESULTS])
        if intact and not self.inventory.facts.pop("detours", []):
            self.sweep.refill(results)
        answer, gathered, sweep = self.answer, self._gathering(), self.sweep
        with ExitStack() as stack:
            late, seal = gathered.front.late, self.inventory.seal(RESULTS)
            whole = stack.enter_context(joining(late, self.rules.schema, results, seal))
            sweep.run(gathered, whole, self.progress, self.wishes)
            answered = [] if answer is None else [answer_row(self.study, answer, self.rules, self.crew)]
            if self.then_load:
                self.crew.begin(self.then_load)
            for row in answered:
                gathered.add(row)
                whole.add(RowsPart.of(row))
            gathered.finish()
            detours: Detours = sum(map(detours_of, answered), sweep.detours)
            self.inventory.facts["detours"] = [{"how": h, "why": why, "designs": n} for (h, why), n in detours.items()]
            if sweep.spent_s:  # else all rows were there
                self.inventory.facts["spent_s"] = [sweep.spent_s, sweep.seconds]
            self.gathered, self._failed, self._warnings = gathered, sweep.failed, sweep.warnings
            self._table = self._aside.submit(stack.pop_all().close)

    def _wait_for_table(self) -> None:
        """Until the result table has its name, nothing else is written, and no chunk leaves the journal."""
        if self._table is not None:
            table, self._table = self._table, None
            table.result()
            self.journal.leave(self.sweep.keys, self._aside)

    def _write_search(self, names: set[str]) -> None:
        assert self.answer is not None
        if SEARCH_LOG in names:
            self._write(SEARCH_LOG, search_log(self.answer))
        if FRONT in names:
            self._write(FRONT, front_table(self.study, self.answer))
        if LEFT_OUT in names:
            kept = self._kept("left out")
            given = self.study, self.answer.search, self.answer.best, kept, self.progress
            self._write(LEFT_OUT, left_out_table(*given))

    def _write_of_rows(self, names: set[str]) -> None:
        points = partial(swept_points, self.inventory.path(RESULTS))
        rows, on_front = self.gathered.frame(), self.gathered.front_frame()
        looking, known = Looking.of(self.study, names), self.sweep.looks
        looks = looks_of(self.study, looking, rows, on_front, known, self.crew, self.progress)
        shown = Shown(self.study, rows, on_front, looks, points, self._limit, self.crew, self._kept, self.progress)
        for name, table in ROW_TABLES.items():
            if name in names:
                made = table.made(shown)
                self._wait_for_table()
                self._write(name, made)

    def _write(self, name: str, table: pa.Table) -> None:
        """Write a table with the filter's number beside each design's, and with units and meanings."""
        if "design_id" in table.column_names and "filter_id" not in table.column_names:
            ids = table["design_id"].to_numpy(zero_copy_only=False)
            filters = np.where(ids == self.study.n_designs, self.study.n_filters, ids % max(1, self.study.n_filters))
            at = table.column_names.index("design_id") + 1
            table = table.add_column(at, "filter_id", pa.array(filters, pa.int64(), from_pandas=True))
        self.inventory.write_table(name, table.cast(described(table.schema, self.study.quantities)))

    def _kept(self, what: str) -> Kept:
        """Calls whose results the journal keeps."""
        return Kept(self.crew, self.journal, f"{self.sweep.fingerprint} {what}")

    def _write_vision(self, names: set[str]) -> None:
        from .vision import vision_tables  # noqa: PLC0415  (only where a study asks for images)

        parallel = self._kept("vision")
        tables = vision_tables(self.study, self.gathered.frame(), parallel, self.progress)
        for name in names & tables.keys():
            self._write(name, tables[name])

    def _limit(self) -> Limit | None:
        """The search's limit, found alone where the search itself need not be repeated."""
        if "answer" in self.__dict__ or self.study.search is None:
            return None if self.answer is None else self.answer.limit
        return limit_alone(self.study, self.study.search)

    def _provenance(self) -> Provenance:
        study, gathered, answer = self.study, self.gathered, self.answer
        found: dict[str, Any] = {
            "filters": study.n_filters + (answer is not None),
            "designs": study.n_designs + (answer is not None),
            "failed": self._failed,
            "plans": plan_facts(study),
            "trade_off": study.trade_off,
            "parameters": study.parameters,
            "quantities": [quantity.column for quantity in study.quantities.values()],
            "detours": self.inventory.facts.setdefault("detours", []),
            "spent_s": self.inventory.facts.setdefault("spent_s", [0.0, 0.0]),
        }
        counted: Detours = Counter({(each["how"], each["why"]): each["designs"] for each in found["detours"]})
        warnings = [*study.warnings, *self._warnings, *detours_in_words(counted)]
        warnings += spent_in_words(whole_readout_metrics(study.asked), *found["spent_s"])
        if answer is not None:
            found["search"] = search_facts(study, answer)
            if "saturation" in study.plans[answer.search.scenario].computed:
                warnings.append("pixels may saturate: the search sees them before clipping, its row after")
            if answer.front:
                found["hypervolume"] = _hypervolumes(answer, gathered.swept)
                found["hypervolume_least_sensitivity"] = answer.search.levels[0]
        self.inventory.facts.setdefault("duration_s", round(time.monotonic() - self.started, 3))
        seconds = max(_CHECK_S, _CHECK_SHARE * float(self.inventory.facts["duration_s"]))
        found["check"], unchecked = check_run(study, self.inventory.path(RESULTS), seconds, self.crew)
        warnings += unchecked
        return Provenance(**provenance(study, self.inventory.facts), **found, warnings=tuple(warnings))


def fits(inventory: Inventory, study: Study, rules: Rules) -> bool:
    """Whether the result table has the columns and the rows that this version of the program gives it."""
    try:
        held = pq.read_metadata(inventory.path(RESULTS))
        wanted = study.n_designs + (study.search is not None)
        return held.num_rows == wanted and bool(held.schema.to_arrow_schema().equals(rules.schema))
    except (OSError, pa.ArrowException):
        return False


def _hypervolumes(answer: SearchAnswer, swept: Front) -> dict[str, float]:
    """Area that the designs of sweep and search dominate above no separation and the lowest level of sensitivity."""
    reference = np.array([0.0, answer.search.levels[0] - 1e-6])
    runs = (*answer.runs, *(run for point in answer.front for run in point.runs))
    found = [[e.objective, e.sensitivity] for run in runs for e in run.log if e.violation <= FEASIBLE]
    return {
        "sweep": hypervolume(swept.points(answer.search.space.cfa, answer.search.scenario), reference),
        "search": hypervolume(np.array(found).reshape(-1, 2), reference),
    }
