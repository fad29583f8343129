"""Run one study as the command asks, or say what that would do."""

from __future__ import annotations

import os
import sys
import webbrowser
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import typer

from .. import run as runner
from ..base.errors import Fault, InterruptedRunError, SweepError
from ..results.names import REPORT
from ..results.tables import PROVENANCE
from ..run.workers import Workers, called_by, workers
from ..study import Study, folder_name, load_study
from .endings import end_now
from .progress import ProgressDisplay

_DRAWING = (
    "sweep.report.overview",
    "matplotlib.figure",
    "matplotlib.backends.backend_agg",
    "matplotlib.backends.backend_svg",
)
"""Modules that pictures need."""


@dataclass(frozen=True)
class Manner:
    """How studies are run; see the options of `sweep run`. `changes`: dotted key -> value instead of the file's."""

    data: Path | None
    output: Path
    jobs: int | None
    backend: str
    scheduler: str | None
    dry_run: bool
    wishes: runner.Wishes
    changes: dict[str, str]
    allow_code: bool
    opens: bool

    @property
    def workers(self) -> int:
        """Of this machine."""
        return self.jobs or os.cpu_count() or 1


def run_one(path: Path, manner: Manner, began_s: float) -> None:
    """Run a study, or continue it, and draw its report; errors as for `run_study`.

    `began_s`: when the user began to wait, by the monotonic clock.
    """
    if manner.backend not in runner.BACKENDS:
        allowed = ", ".join(runner.BACKENDS)
        raise SweepError(Fault("unknown backend", key="--backend", value=manner.backend, allowed=allowed))
    loaded = load_study(path, manner.data, changes=manner.changes, allow_code=manner.allow_code)
    folder, note = runner.output_folder(manner.output / folder_name(loaded.name), loaded)
    if note is not None:
        typer.echo(f"Note: {note}.", err=True)
    if manner.dry_run:
        _tell(loaded, folder, manner)
        return
    kind = runner.usable_backend(manner.backend)
    if kind != manner.backend:
        typer.echo(f"Note: no shared memory (/dev/shm) for worker processes; backend {kind}.", err=True)
    try:
        with runner.stop_on_signals(ends_process=True) as stop, ExitStack() as stack:
            # The run's worker processes draw, too; threads must not, and to start some takes as long as drawing.
            pooled = kind == "loky" and manner.workers > 1
            crew = stack.enter_context(workers(Workers(manner.workers, stop))) if pooled else None
            if crew is not None and not (folder / PROVENANCE).exists():  # it is not finished, so there is work to do
                crew.begin(called_by(loaded))
            with ProgressDisplay() as display:
                made = runner.run_study(
                    loaded,
                    folder,
                    manner.workers,
                    display.update,
                    sys.argv,
                    backend=kind,
                    scheduler=manner.scheduler,
                    wishes=manner.wishes,
                    stop=stop,
                    then_load=_DRAWING if pooled else (),
                )
            if not made:
                typer.echo(f"Note: {folder} holds this very study, finished; nothing was computed.", err=True)
            from .audit import mend_audit  # noqa: PLC0415  (what tables need is loaded while workers compute)
            from .finish import finish  # noqa: PLC0415

            mend_audit(folder, manner.data)
            finish(folder, began_s, mend=True, parallel=crew if made else None)
    except InterruptedRunError as error:
        if kind == "threading":  # what its threads are at cannot be broken off
            end_now(error)
        raise
    if manner.opens and not webbrowser.open((folder / REPORT).absolute().as_uri()):
        typer.echo(f"Note: no browser was found for {folder / REPORT}.", err=True)


def _tell(study: Study, folder: Path, manner: Manner) -> None:
    """Say what a run would do."""
    found = runner.to_do(study, folder, manner.workers)
    for line in runner.to_do_lines(found, folder):
        typer.echo(line)
