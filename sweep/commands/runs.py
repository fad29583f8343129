"""Run one study as the command asks, or say what that would do."""

from __future__ import annotations

import os
import sys
import webbrowser
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import typer

from .. import run as runner
from ..base.errors import Fault, SweepError
from ..results.tables import REPORT
from ..run.workers import workers
from ..study import Study, folder_name, load_study
from .progress import ProgressDisplay
from .said import say_to


@dataclass(frozen=True)
class RunCommand:
    """Options of a run; see the options of `sweep run`. `changes`: dotted key -> value instead of the file's."""

    data: Path | None
    output: Path
    jobs: int | None
    backend: str
    scheduler: str | None
    dry_run: bool
    run_options: runner.RunOptions
    changes: dict[str, str]
    allow_code: bool
    opens: bool
    as_json: bool
    quiet: bool

    @property
    def workers(self) -> int:
        """Of this machine."""
        return self.jobs or os.cpu_count() or 1

    def note(self, text: str) -> None:
        """Say something beside the results, on stderr."""
        if not self.quiet:
            typer.echo(f"Note: {text}", err=True)


def run_one(path: Path, command: RunCommand, began_s: float) -> dict[str, Any]:
    """Run a study, or continue it, draw its report and say what it found; the same as plain values.

    `began_s`: when the user began to wait, by the monotonic clock. Errors as for `run_study`.
    """
    if command.backend not in runner.BACKENDS:
        allowed = ", ".join(runner.BACKENDS)
        raise SweepError(Fault("unknown backend", key="--backend", value=command.backend, allowed=allowed))
    loaded = load_study(path, command.data, changes=command.changes, allow_code=command.allow_code)
    folder, note = runner.output_folder(command.output / folder_name(loaded.name), loaded)
    if note is not None:
        command.note(f"{note}.")
    if command.dry_run:
        return _to_do(loaded, folder, command)
    with runner.stopped_by_signals():
        with ProgressDisplay(quiet=command.quiet) as display:
            made = runner.run_study(
                loaded,
                folder,
                command.workers,
                display.update,
                sys.argv,
                backend=command.backend,
                scheduler=command.scheduler,
                options=command.run_options,
            )
        if not made:
            command.note(f"{folder} holds this very study, finished; nothing was computed.")
        from .audit import mend_audit  # noqa: PLC0415  (what tables need is loaded while workers compute)
        from .finish import finish  # noqa: PLC0415

        mend_audit(folder, command.data)
        with workers(command.workers if made and command.backend == "loky" else 1) as crew:
            facts = finish(folder, began_s, mend=True, parallel=crew, as_json=command.as_json, quiet=command.quiet)
    if command.opens and not webbrowser.open((folder / REPORT).absolute().as_uri()):
        command.note(f"no browser was found for {folder / REPORT}.")
    return {"computed": bool(made), **facts}


def _to_do(study: Study, folder: Path, command: RunCommand) -> dict[str, Any]:
    """Say what a run would do."""
    left = runner.to_do(study, folder, command.workers)
    lines = runner.to_do_lines(left, folder)
    say_to(lines, as_json=command.as_json, quiet=command.quiet)
    rows = {"designs": study.n_designs, "finished_designs": left.finished, "parts": left.chunks}
    return {"folder": str(folder), **rows, "searches": left.searches}
