"""How far a run is, from another terminal: what its folder says, without touching it."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

from ..errors import Fault, OutputError
from ..journal import SHARDS, Entry, Journal, holder
from ..store import PROVENANCE, RESULTS
from .folders import RUN, held_by, read_facts

_RECENT = 200


def status_lines(folder: Path) -> list[str]:
    """State, progress with rate and time left, failures and files of a run. Raises OutputError where there is none."""
    held = held_by(folder)
    if held is None:
        raise OutputError(Fault("no run here", str(folder), allowed="a folder that `sweep run` made"))
    running = holder(folder)
    if held.finished and running is None:
        facts = read_facts(folder / PROVENANCE)
        failed = f", {facts['failed']:,} failed" if facts.get("failed") else ""
        return [f"finished: {facts['designs']:,} designs{failed} in {facts['duration_s']:.1f} s.", _files(folder)]
    facts = read_facts(folder / RUN)
    entries = Journal(folder).entries.values()
    rows = [entry for entry in entries if entry.rows]
    done, total = sum(entry.rows for entry in rows), int(facts.get("designs", 0))
    faults = sum(entry.failed for entry in rows)
    state = f"running ({running})" if running else "interrupted; the same command continues"
    share = f" ({done / total:.1%})" if total else ""
    lines = [f"{state}: {done:,} of {total:,} designs{share}, {faults:,} failed, {len(rows):,} chunks finished."]
    answers = len(entries) - len(rows)
    if answers:
        lines.append(f"The search has {answers:,} answers.")
    rate = _rate(rows)
    if running and rate and total:
        lines.append(f"{rate:,.0f} designs/s, about {(total - done) / rate:,.0f} s left.")
    return [*lines, _files(folder)] if rows else lines


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
