"""How far a run is, from another terminal: what its folder says, without touching it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..base.disk import read_facts
from ..base.errors import OutputError
from ..metrics.share import told_share
from ..results.inventory import Inventory, faults_of, no_run
from ..results.lock import in_use
from ..results.parts import ANSWER, PARTS, ROWS, Parts
from ..results.tables import PROVENANCE, RESULTS, rows_in

_MOST = 2**53


@dataclass(frozen=True)
class Status:
    """State of a run: lines for people, and plain values."""

    lines: Sequence[str]
    facts: Mapping[str, Any]


def status_of(folder: Path, *, verify: bool = False) -> Status:
    """State, progress and files of a run.

    Of a finished run missing files are named; with `verify` all digests are compared. Raises OutputError where there
    is no run, and, naming each file, where some are missing or damaged.
    """
    inventory = Inventory(folder)
    if not inventory.fingerprint:
        raise no_run(folder)
    running = in_use(folder)
    finished = PROVENANCE in inventory.files and not running
    if finished or (verify and not running):
        wrong = inventory.wrong(quick=not verify) | inventory.wrong([PROVENANCE] if finished else [])
        if wrong:
            raise OutputError(faults_of(folder, wrong))
    verified = [f"ok: its {len(inventory.files)} files are what the run wrote."] if verify and not running else []
    if finished:
        facts = read_facts(folder / PROVENANCE)
        failed = f", {_number(facts, 'failed'):,} failed" if _number(facts, "failed") else ""
        said = f"finished: {_number(facts, 'designs'):,} designs{failed} in {_number(facts, 'duration_s'):.1f} s."
        known = {key: facts.get(key) for key in ("designs", "failed", "duration_s")}
        return Status([said, _files(folder), *verified], _facts(folder, "finished", verify=verify, **known))
    parts = Parts(folder)
    rows, answers = parts.paths(ROWS), parts.paths(ANSWER)
    done, total = sum(map(rows_in, rows)), _number(inventory.facts, "designs")
    state = "running" if running else "interrupted; the same command continues"
    share = f" ({told_share(done / total)})" if total else ""
    lines = [f"{state}: {done:,} of {total:,} designs{share}, {len(rows):,} parts finished."]
    if answers:
        lines.append(f"The search has {len(answers):,} answers.")
    known = {"designs": total, "finished_designs": done, "parts": len(rows), "search_answers": len(answers)}
    return Status(
        [*lines, *([_files(folder)] if rows else []), *verified],
        _facts(folder, "running" if running else "interrupted", verify=verify, **known),
    )


def _facts(folder: Path, state: str, *, verify: bool, **known: Any) -> dict[str, Any]:
    return {"folder": str(folder), "state": state, "verified": verify, **known}


def _number(facts: Mapping[str, Any], key: str) -> float:
    """A number of a file that anyone may have written; 0 where it says none of a likely size."""
    found = facts.get(key)
    return found if isinstance(found, int | float) and 0 <= found < _MOST else 0


def _files(folder: Path) -> str:
    if (folder / RESULTS).is_file():
        return f"Files: {folder}/: {RESULTS}, report.html."
    return f"Finished parts: {folder / PARTS}/*.parquet, which pandas.read_parquet reads."
