"""The whole run: what is finished stays, what is missing or damaged is made."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..base.disk import read_facts
from ..base.errors import Fault, InfeasibleError, StudyError
from ..base.types import Progress
from ..results.facts import Provenance, lacking
from ..results.folder import begin
from ..results.inventory import Inventory
from ..results.journal import Journal
from ..results.lock import LOCK, locked
from ..results.tables import PROVENANCE, RESOLVED, RESULTS
from ..study import Study
from ..study.reach import out_of_reach
from ..vision.installed import require_network
from .files import Making, files_of, fits
from .provenance import resolved_yaml
from .rows import rules_of
from .stop import Stop, stop_on_signals
from .wishes import NONE, Wishes
from .workers import Workers, called_by, workers

_HOW = ("command", "backend", "scheduler", "workers", "duration_s")
"""What provenance and `run.json` both say of how a run went, so that either makes the other again."""
_OF_ROWS = ("detours", "spent_s")
"""Kept in both as well: which designs took another route than their block's own, and what metrics of the whole readout
took."""


def run_study(
    study: Study,
    output: Path,
    n_jobs: int,
    progress: Progress,
    command: Sequence[str] = (),
    *,
    backend: str = "loky",
    scheduler: str | None = None,
    wishes: Wishes = NONE,
    stop: Stop | None = None,
    then_load: Sequence[str] = (),
) -> tuple[str, ...]:
    """Run a study into `output`; what an earlier run of the same study finished is kept, if it is not damaged.

    Writes `results.parquet`, `search.parquet` and `front.parquet` (when the study searches), `curves.parquet`,
    `points.parquet`, `recognition.parquet` (when the study asks for it), `study.resolved.yaml` and `provenance.json`,
    each atomically, and lists them with their digests in `run.json` and `SHA256SUMS`. Files that the lists do not name
    are not touched. Returns the names of the files that were made, none when nothing was left to do. `then_load`:
    modules that worker processes load when all rows are computed, for what the caller has them do next.

    Raises OutputError when the folder is in use, holds another study, holds something else under the name of a file of
    the run, or cannot be written; InfeasibleError, before anything is left behind, when the search finds no feasible
    design; FailedDesignError for the first failing design, if it is wished; InterruptedRunError after SIGINT or
    SIGTERM, which are taken here unless the caller takes them into `stop`.
    """
    started = time.monotonic()
    if study.search is not None and (beyond := out_of_reach(study, study.search.space, study.search.scenario)):
        raise InfeasibleError([Fault(f"{study.name}: no design can be feasible"), *beyond])
    if study.section.vision is not None and study.section.vision.network:
        require_network()
    with stop_on_signals(stop) as own, workers(Workers(n_jobs, own, backend, scheduler)) as crew, locked(output):
        inventory = Inventory(output)
        mended, wrong, how = inventory.wrong_lists(), _wrong(inventory, study), _how(inventory)
        retry = wishes.retry_failed and bool(read_facts(output / PROVENANCE).get("failed", 0))
        if retry or how is None:
            how = {"command": list(command), "workers": crew.count, "backend": crew.backend, "scheduler": scheduler}
            how |= {key: inventory.facts[key] for key in _OF_ROWS if key in inventory.facts}
        inventory = begin(output, study, how | {"designs": study.n_designs})
        if wrong == {RESOLVED}:
            inventory.write({RESOLVED: resolved_yaml(study).encode("utf-8")})
        elif wrong or retry:
            try:
                crew.begin(called_by(study))
                study = study.with_plans()
                rules = rules_of(study)
                if retry or not fits(inventory, study, rules):
                    wrong.add(RESULTS)
                making = Making(study, rules, inventory, crew, progress, wishes, started, then_load)
                making.make(wrong)
                wrong |= making.made
            except (StudyError, InfeasibleError):
                _discard(inventory)
                raise
    return (*mended, *sorted(wrong))


def _wrong(inventory: Inventory, study: Study) -> set[str]:
    """Files of the study's run that are not what a run wrote."""
    wrong = set(inventory.wrong(sorted(files_of(study))))
    if lacking(Provenance, read_facts(inventory.path(PROVENANCE))):
        wrong.add(PROVENANCE)
    return wrong


def _how(inventory: Inventory) -> dict[str, Any] | None:
    """How the run went that finished in the folder, out of `run.json` or else of provenance; None where none did."""
    if PROVENANCE not in inventory.files:
        return None
    intact = inventory.guarded or not inventory.wrong([PROVENANCE])
    facts = inventory.facts if inventory.guarded else read_facts(inventory.path(PROVENANCE))
    known = intact and facts.keys() >= {*_HOW}
    return {key: facts[key] for key in (*_HOW, *_OF_ROWS) if key in facts} if known else None


def _discard(inventory: Inventory) -> None:
    """Leave nothing of a run that has no result; what others have in the folder stays."""
    Journal(inventory.folder).remove()
    if inventory.discard():
        with suppress(OSError):
            (inventory.folder / LOCK).unlink()
            inventory.folder.rmdir()
