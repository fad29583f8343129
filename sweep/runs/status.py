"""State of a run, read from its folder in another terminal."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..base.answer import Answer
from ..base.disk import read_facts
from ..base.errors import DamagedRunError
from ..features import modules
from ..metrics.share import format_share
from ..results.answers import Answers
from ..results.dataset import rows_in
from ..results.folder import run_folder
from ..results.lock import in_use
from ..results.manifest import Manifest, issues_of
from ..results.tables import PROVENANCE, REPORT, RESULTS


def status(folder: Path | str, *, verify: bool = False) -> Answer:
    """Return state, progress and files of a run.

    Parameters
    ----------
    folder : path-like
        Folder of a run, also of one that goes on.
    verify : bool
        Compare the digests of all its files.

    Returns
    -------
    Answer
        How far it is.

    Raises
    ------
    SweepError
        If there is no run, or files of a finished run are missing or damaged.
    """
    folder = run_folder(folder)
    manifest = Manifest(folder)
    manifest.require_run()
    running = in_use(folder)
    if manifest.runs:
        of_several: Answer = next(iter(modules("several"))).status_of_several(manifest, verify=verify, running=running)
        return of_several
    finished = PROVENANCE in manifest.files and not running
    require_whole(manifest, verify=verify, running=running)
    if finished:
        facts = read_facts(folder / PROVENANCE)
        state = "finished"
        failed = f", {_number(facts, 'failed'):,} failed" if _number(facts, "failed") else ""
        lines = [f"finished: {_number(facts, 'designs'):,} designs{failed} in {_number(facts, 'duration_s'):.1f} s."]
        values = {key: facts.get(key) for key in ("designs", "failed", "duration_s")}
    else:
        total, answers = _number(manifest.facts, "designs"), len(Answers(folder))
        done, parts = rows_in(folder, total)
        state = "running" if running else "interrupted"
        share = f" ({format_share(done / total)})" if total else ""
        continues = "" if running else "; the same command continues"
        lines = [f"{state}{continues}: {done:,} of {total:,} designs{share}, {parts:,} parts finished."]
        if answers:
            lines.append(f"The search has {answers:,} answers.")
        values = {"designs": total, "finished_designs": done, "parts": parts, "search_answers": answers}
        if parts:
            lines.append(f"Finished parts: {folder / RESULTS}, which pandas.read_parquet reads.")
    lines += lines_of_files(manifest, finished=finished, verified=verify and not running)
    return Answer(lines, {"folder": str(folder), "state": state, "verified": verify, **values})


def require_whole(manifest: Manifest, *, verify: bool, running: bool) -> None:
    """Raise DamagedRunError for files of a finished run that are missing, or that `verify` finds otherwise wrong."""
    finished = PROVENANCE in manifest.files
    if running or not (verify or finished):
        return
    wrong = manifest.wrong(None if verify else manifest.files, quick=not verify)
    if verify and finished and REPORT not in manifest.files:
        wrong[REPORT] = "is not drawn"
    if wrong:
        raise DamagedRunError(issues_of(manifest.folder, wrong))


def lines_of_files(manifest: Manifest, *, finished: bool, verified: bool) -> list[str]:
    """Return what there is in the folder, and what does not belong there."""
    lines = list(manifest.notes)
    if finished and REPORT in manifest.files:
        lines.append(f"Files: {manifest.folder}/: {RESULTS}, {REPORT}.")
    elif finished:
        lines.append(f"Files: {manifest.folder}/: {RESULTS}; `sweep report {manifest.folder}` draws its report.")
    if verified:
        lines.append(f"ok: its {len(manifest.files)} files are as the run wrote them.")
    return lines


def _number(facts: Mapping[str, Any], key: str) -> float:
    """Return a number of a file that anyone may have written; 0 where it says none of a likely size."""
    value = facts.get(key)
    return value if isinstance(value, int | float) and 0 <= value < 2**53 else 0
