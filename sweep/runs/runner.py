"""Run of a study: search, sweep, derived tables, and provenance."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import nullcontext, suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from ..base.disk import read_facts
from ..base.errors import InfeasibleError, StudyError, UpperBoundExceededError
from ..base.types import IndexArray, Int, Progress
from ..camera.curve_errors import UNCLIPPED
from ..designs.plugin import PluginFamily
from ..features import gathered, modules
from ..results.answers import Answers
from ..results.dataset import part_name
from ..results.dictionary import described
from ..results.facts import Provenance, missing_keys
from ..results.folder import begin
from ..results.identity import run_facts
from ..results.lock import LOCK, clear, locked
from ..results.manifest import Manifest
from ..results.shown import Gathered, Selection, best_rows, designs_of, front_rows, joined, shown_rows
from ..results.tables import (
    COMBINATIONS,
    DESIGNS,
    FRONT,
    ON_FRONT,
    PARETO,
    PROVENANCE,
    RESOLVED,
    SEARCH_LOG,
    SEARCHED,
    SWEPT,
    json_of,
    read_table,
    word_mask,
)
from ..search.combinations import numbers_of
from ..search.problem import CONVERGED
from ..search.upper_bound import UpperBound
from ..study import Study
from ..study.goals import refuse_unreachable
from ..study.inputs import INPUTS, archive_of
from .analysis import Shown
from .check import check_run
from .derived import row_tables
from .details import design_details
from .dry_run import seconds_of_effects
from .kept import CachedCalls
from .provenance import plan_facts, provenance, resolved_yaml
from .rows import parts_of
from .search import (
    OtherSearch,
    SearchAnswer,
    answer_rows,
    combinations_table,
    front_table,
    limit_alone,
    run_search,
    search_facts,
    search_log,
)
from .sweep import Planned, RunOptions, Sweep
from .workers import Workers, stopped_by_signals, workers

if TYPE_CHECKING:
    import pandas as pd

_FEW = 64
"""Designs that threads compute."""
_CHECK_S, _CHECK_SHARE = 0.5, 0.05
"""Time of the check at the end of a run: seconds, or a share of the run, whichever is longer."""


def files_of(study: Study) -> set[str]:
    """Return the names of the files that a run makes."""
    return {*_inputs(study), *_whole(study), *row_tables(study)}


def _inputs(study: Study) -> dict[str, bytes]:
    """Return the study as a run keeps it, with the files that it was made from."""
    archive = {INPUTS: archive_of(study.inputs)} if study.inputs else {}
    return {RESOLVED: resolved_yaml(study).encode("utf-8"), **archive}


def _whole(study: Study) -> set[str]:
    """Return the files for which the whole run is made again."""
    parts = parts_of(study)
    names = {DESIGNS, PARETO, PROVENANCE, *(part_name(part.number) for part in parts)}
    if study.search is not None:
        names |= {SEARCH_LOG, part_name(len(parts))} | ({FRONT} if study.search.levels else set())
        names |= {name for module in modules("search") if module.asked(study.search) for name in module.TABLES}
        names |= {COMBINATIONS} if len(numbers_of(study.problem(study.search))) > 1 else set()
    return names


def usual_backend(study: Study) -> str:
    """Return threads for so few designs that processes would take longer to start, else processes."""
    section, scenes = study.section, study.scenarios.values()
    slow = study.search is not None or study.states or section.population is not None
    slow = slow or any(feature.slow for feature in study.features.values())
    many = study.n_designs > _FEW or len(scenes) > 1 or any(scene.target is not None for scene in scenes)
    own_families = any(space.filter and isinstance(space.filter.family, PluginFamily) for space in study.spaces)
    user_code = section.metrics or section.effects or own_families
    return "loky" if slow or many or user_code else "threading"


def run_study(
    study: Study,
    output: Path,
    n_jobs: int,
    progress: Progress,
    command: Sequence[str] = (),
    *,
    backend: str | None = None,
    scheduler: str | None = None,
    options: RunOptions = RunOptions(),  # noqa: B008  (a frozen value)
    pool: Workers | None = None,
) -> tuple[str, ...]:
    """Run a study into a folder, or continue a stopped run; a finished one is only repaired.

    A table of the report that is missing or damaged is made again from the rows that it shows. Where rows, the
    search's tables or provenance are, all of it is, but for parts that are whole. `pool`: workers; left out, those of
    `backend` are started.

    Raises OutputError: the folder is in use, holds another study or files of others, or cannot be written. Raises
    InfeasibleError: the search finds no feasible design; nothing is left behind. Raises FailedDesignError: a design
    failed, with `fail_fast`. Raises InterruptedRunError: SIGINT or SIGTERM came; finished parts are kept. Returns the
    names of the files that were made; none when nothing was left to do.
    """
    started = time.monotonic()
    refuse_unreachable(study)
    with stopped_by_signals(), locked(output):
        manifest = begin(output, run_facts(study))
        manifest.remove(manifest.wrong(manifest.files.keys() & gathered("ADDED").keys()))
        wrong = set(manifest.wrong(files_of(study)))
        facts = read_facts(manifest.path(PROVENANCE))
        if missing_keys(Provenance, facts) or (options.retry_failed and facts["failed"]):
            wrong.add(PROVENANCE)
        if not wrong:
            return ()
        backend = backend or usual_backend(study)
        with nullcontext(pool) if pool is not None else workers(n_jobs, backend, scheduler) as started_pool:
            how = {
                "command": list(command),
                "workers": started_pool.count,
                "backend": started_pool.backend,
                "scheduler": scheduler,
            }
            run = _Run(study.with_plans(), manifest, started_pool, progress, options, started, how)
            try:
                return run.make(wrong)
            except (StudyError, InfeasibleError):
                discard(manifest)
                raise


@dataclass
class _Run:
    """One run of a planned study in a locked folder.

    `started` is a time of the monotonic clock, s; `how` has command, workers, backend and scheduler.
    """

    study: Study
    manifest: Manifest
    pool: Workers
    progress: Progress
    options: RunOptions
    started: float
    how: dict[str, Any]

    def __post_init__(self) -> None:
        self.planned, self.answers = Planned.of(self.study), Answers(self.manifest.folder)
        self.rules, self.selection = self.planned.rules, self.planned.selection
        self.sweep = Sweep(self.planned, self.manifest, self.pool)
        self.gathered = Gathered(self.selection, self.rules.wanted_of_swept.schema)
        self.other: OtherSearch | None = None

    def make(self, wrong: set[str]) -> tuple[str, ...]:
        """Make files and those that depend on them; provenance comes last, and marks a finished run."""
        study = self.study
        if wrong & _whole(study):
            wrong = files_of(study)
            self.manifest.remove([PROVENANCE])
            self.manifest.discard_derived()
            self._search_and_sweep()
        if wrong & row_tables(study).keys():
            self._write_row_tables(wrong)
        self.manifest.write(_inputs(study))
        if PROVENANCE in wrong:
            facts = self._provenance().model_dump(mode="json")
            self.manifest.write({PROVENANCE: json_of(facts).encode("utf-8")})
        self.answers.remove()
        return tuple(sorted(wrong))

    @cached_property
    def answer(self) -> SearchAnswer | None:
        """Answer of the search; None for a study without a search."""
        if self.study.search is None:
            return None
        cached_calls = self._kept("search")
        try:
            for module in modules("search"):
                if module.asked(self.study.search):
                    self.other = module.run(self.study, self.study.search, self.rules, cached_calls, self.progress)
                    return self.other.answer
            return run_search(self.study, self.study.search, self.rules, cached_calls, self.progress)
        except UpperBoundExceededError:
            cached_calls.drop_limits()
            raise

    def _kept(self, what: str) -> CachedCalls:
        """Return calls whose answers are kept."""
        return CachedCalls(self.pool, self.answers, f"{self.planned.fingerprint} {what}")

    def _search_and_sweep(self) -> None:
        """Search, sweep, and write the tables of both; an infeasible search ends the run before the sweep."""
        answer, sweep, shown = self.answer, self.sweep, self.rules.shown
        sweep.run(self.gathered, self.progress, self.options)
        answered = shown.empty_table()
        if answer is not None:
            answered = pa.concat_tables(answer_rows(self.study, answer, self.rules, self.pool)).unify_dictionaries()
            sweep.write_answers(answered, self.gathered)
        rows, sample = self.gathered.finish()
        of_parts = rows.filter(pa.array(~word_mask(rows, "kind", SEARCHED)))
        all_columns = joined([sweep.with_all_columns(of_parts), answered], shown)
        at = shown.get_field_index(ON_FRONT)
        all_columns = all_columns.set_column(at, shown.field(at), rows[ON_FRONT])
        self._write(DESIGNS, designs_of(all_columns, sample, self.selection, next(iter(self.study.scenarios))))
        self._write(PARETO, all_columns.filter(all_columns[ON_FRONT]))
        if answer is not None:
            self._write(SEARCH_LOG, search_log(answer))
            if answer.choice is not None:
                self._write(COMBINATIONS, combinations_table(self.study, answer))
            if self.other is not None:
                for name, table in self.other.tables.items():
                    self._write(name, table)
            elif answer.search.levels:
                self._write(FRONT, front_table(self.study, answer))

    @cached_property
    def shown(self) -> pa.Table:
        """Rows that the report shows, from their files."""
        return shown_rows(*(read_table(self.manifest.path(name)) for name in (DESIGNS, PARETO)))

    def _frame(self, select: Callable[[pa.Table, Selection, str], Int[IndexArray, " rows"]]) -> pd.DataFrame:
        at = select(self.shown, self.selection, next(iter(self.study.scenarios)))
        frame: pd.DataFrame = self.shown.take(at).to_pandas()
        return frame

    def _write_row_tables(self, names: set[str]) -> None:
        rows, on_front = self._frame(best_rows), self._frame(front_rows)
        details = design_details(self.study, names, rows, on_front, self.pool, self.progress)
        swept = word_mask(self.shown, "kind", SWEPT) & word_mask(self.shown, "status", "ok")
        points = self.shown["design_id"].to_numpy()[swept]
        shown = Shown(self.study, rows, on_front, details, points, self._limit, self.pool, self._kept, self.progress)
        for name, table in row_tables(self.study).items():
            if name in names:
                self._write(name, table.make(shown))

    def _write(self, name: str, table: pa.Table) -> None:
        """Write a table with `filter_id` beside `design_id`, and with units and meanings."""
        if "design_id" in table.column_names and "filter_id" not in table.column_names:
            ids = table["design_id"].to_numpy(zero_copy_only=False)
            filters = np.where(ids >= self.study.n_designs, self.study.n_filters, ids % max(1, self.study.n_filters))
            at = table.column_names.index("design_id") + 1
            table = table.add_column(at, "filter_id", pa.array(filters, pa.int64(), from_pandas=True))
        self.manifest.write_table(name, table.cast(described(table.schema, self.study.columns)))

    def _limit(self) -> UpperBound | None:
        """Return the upper bound of a search in one scenario, computed alone if the search need not be repeated."""
        search = self.study.search
        if search is not None and (len(search.scenarios) > 1 or search.tiles):
            return None
        if "answer" in self.__dict__ or self.study.search is None:
            return None if self.answer is None else self.answer.upper_bound
        return limit_alone(self.study, self.study.search)

    def _provenance(self) -> Provenance:
        study, sweep, answer = self.study, self.sweep, self.answer
        facts: dict[str, Any] = {
            "filters": study.n_filters + (answer is not None),
            "designs": study.n_designs + (0 if answer is None else len(answer.search.scenarios)),
            "failed": sweep.failed,
            "counts": [[*group, n] for group, n in sorted(self.gathered.counts.items())],
            "plans": plan_facts(study),
            "trade_off": study.trade_off,
            "parameters": study.parameters,
            "quantities": [quantity.column for quantity in study.quantities.values()],
        }
        warnings = [*study.warnings, *sweep.warnings]
        if study.section.uncertainty is not None and any(
            "saturation" in plan.computed for plan in study.plans.values()
        ):
            warnings.append(UNCLIPPED)
        if answer is not None:
            facts["search"] = search_facts(study, answer)
            facts["search"] |= {} if self.other is None else {"features": self.other.facts}
            if not any(run.status in CONVERGED for run in answer.runs):
                warnings.append("no start of the search converged: more `max_evaluations` may find a better design")
            noisy = any(study.quantities[name].states for name in study.objective.weights)
            knows = noisy and study.pixel.captures  # merged readings, in which a search sees saturation
            if "saturation" in study.plans[answer.scenario].computed and not knows:
                warnings.append("pixels may saturate: the search sees them before clipping, its row after")
        duration_s = round(time.monotonic() - self.started, 3)
        seconds = max(_CHECK_S, _CHECK_SHARE * duration_s)
        facts["seconds_of_effects"] = seconds_of_effects(study)
        facts["check"], unchecked = check_run(study, self.manifest.folder, seconds, self.pool)
        how = self.how | {"duration_s": duration_s}
        return Provenance(**provenance(study, how), **facts, warnings=(*warnings, *unchecked))


def discard(manifest: Manifest) -> None:
    """Remove everything of a run without a result; files of others stay."""
    Answers(manifest.folder).remove()
    manifest.discard()
    clear(manifest.folder)
    with suppress(OSError):
        (manifest.folder / LOCK).unlink()
        manifest.folder.rmdir()
