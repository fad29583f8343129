"""How far a run is, from another terminal: what its folder says, without touching it."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..base.disk import read_facts
from ..base.errors import OutputError
from ..metrics.share import told_share
from ..results.folder import held_by
from ..results.inventory import Inventory, faults_of, no_run
from ..results.journal import SHARDS, Entry, Journal
from ..results.lock import holder
from ..results.tables import PROVENANCE, RESULTS

_RECENT, _MOST = 200, 2**53


def status_lines(folder: Path, *, verify: bool = False) -> list[str]:
    """State, progress with rate and time left, failures and files of a run.

    Of a finished run the sizes of its files are compared with its lists, and the digests of what is read; with `verify`
    all digests. Raises OutputError where there is no run, and, naming each file, where some are missing or damaged.
    """
    held, inventory = held_by(folder), Inventory(folder)
    if held is None or not held.fingerprint:
        raise no_run(folder)
    running = holder(folder)
    finished = PROVENANCE in inventory.files and running is None
    if finished or (verify and running is None):
        _verify(inventory, quick=not verify)
    verified = [_verified(inventory)] if verify and running is None else []
    if finished:
        facts = read_facts(folder / PROVENANCE)
        failed = f", {_number(facts, 'failed'):,} failed" if _number(facts, "failed") else ""
        said = f"finished: {_number(facts, 'designs'):,} designs{failed} in {_number(facts, 'duration_s'):.1f} s."
        return [said, _files(folder), *verified]
    entries = Journal(folder).entries.values()
    rows = [entry for entry in entries if entry.rows]
    done, total = sum(entry.rows for entry in rows), _number(inventory.facts, "designs")
    faults = sum(entry.failed for entry in rows)
    state = f"running ({running})" if running else "interrupted; the same command continues"
    share = f" ({told_share(done / total)})" if total else ""
    lines = [f"{state}: {done:,} of {total:,} designs{share}, {faults:,} failed, {len(rows):,} chunks finished."]
    answers = len(entries) - len(rows)
    if answers:
        lines.append(f"The search has {answers:,} answers.")
    rate = _rate(rows)
    if running and rate and total:
        lines.append(f"{rate:,.0f} designs/s, about {(total - done) / rate:,.0f} s left.")
    return [*lines, *([_files(folder)] if rows else []), *verified]


def _verify(inventory: Inventory, *, quick: bool) -> None:
    """Raises OutputError with a line for each file that is not what the run wrote."""
    wrong = inventory.wrong_lists() | inventory.wrong(quick=quick)
    if quick and PROVENANCE in inventory.files:
        wrong |= inventory.wrong([PROVENANCE])
    if wrong:
        raise OutputError(faults_of(inventory.folder, wrong))


def _number(facts: Mapping[str, Any], key: str) -> float:
    """A number of a file that anyone may have written; 0 where it says none of a likely size."""
    found = facts.get(key)
    return found if isinstance(found, int | float) and 0 <= found < _MOST else 0


def _verified(inventory: Inventory) -> str:
    size = sum(held.size or 0 for held in inventory.files.values())
    return f"ok: its {len(inventory.files) + 2} files ({size / 2**20:,.1f} MiB) are what the run wrote."


def _rate(entries: Sequence[Entry]) -> float | None:
    """Designs per second over the latest chunks; None before there are two, or when the clock went back."""
    recent = entries[-_RECENT:]
    if len(recent) < 2:
        return None
    span = time.time() - recent[0].at
    return sum(entry.rows for entry in recent[1:]) / span if span > 0 else None


def _files(folder: Path) -> str:
    if (folder / RESULTS).is_file():
        return f"Files: {folder}/: {RESULTS}, report.html."
    return f"Finished chunks: {folder / SHARDS}/*.parquet, which pandas.read_parquet reads."
