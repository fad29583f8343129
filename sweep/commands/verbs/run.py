"""Run a study."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path
from typing import Annotated

import typer

from ...errors import Fault, InterruptedRunError, SweepError
from ..endings import end_now
from ..finish import finish
from ..options import DataFolder, Outputs, StudyPath
from ..panels import OF_STUDIES

PANEL = OF_STUDIES


def run(
    study: StudyPath,
    data: DataFolder = None,
    output: Outputs = Path("outputs"),
    jobs: Annotated[int | None, typer.Option(min=1, help="Workers.", show_default="all cores")] = None,
    backend: Annotated[str, typer.Option(help="loky (processes), threading, or dask (a cluster).")] = "loky",
    scheduler: Annotated[str | None, typer.Option(help="Of Dask: tcp://HOST:PORT.", show_default=False)] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Say what is to do and what it takes.")] = False,
    fail_fast: Annotated[bool, typer.Option("--fail-fast", help="Stop at the first design that fails.")] = False,
    retry_failed: Annotated[bool, typer.Option("--retry-failed", help="Compute failed designs again.")] = False,
) -> None:
    """Run a study: results, figures and report go to OUTPUT/<study>. The same command continues an interrupted run,
    and makes again what is missing or damaged. Files that are not its own stay (run.json lists those that are).
    """
    began_s = time.monotonic()
    from ... import run as runner
    from ...study import folder_name, load_study
    from ..audit import mend_audit
    from ..progress import ProgressDisplay

    if backend not in runner.BACKENDS:
        allowed = ", ".join(runner.BACKENDS)
        raise SweepError(Fault("unknown backend", key="--backend", value=backend, allowed=allowed))
    loaded, workers = load_study(study, data), jobs or os.cpu_count() or 1
    folder, note = runner.output_folder(output / folder_name(loaded.name), loaded)
    if note is not None:
        typer.echo(f"Note: {note}.", err=True)
    if dry_run:
        with ProgressDisplay() as display:
            found = runner.estimate(loaded, folder, workers, display.update)
        for line in runner.estimate_lines(found, folder):
            typer.echo(line)
        return
    kind, wishes = runner.usable_backend(backend), runner.Wishes(fail_fast, retry_failed)
    if kind != backend:
        typer.echo(f"Note: no shared memory (/dev/shm) for worker processes; backend {kind}.", err=True)
    try:
        with runner.stop_on_signals(ends_process=True) as stop:
            with ProgressDisplay() as display:
                given = (loaded, folder, workers, display.update, sys.argv)
                made = runner.run_study(*given, backend=kind, scheduler=scheduler, wishes=wishes, stop=stop)
            if not made:
                typer.echo(f"Note: {folder} holds this very study, finished; nothing was computed.", err=True)
            mend_audit(folder, data)
            finish(folder, began_s, mend=True)
    except InterruptedRunError as error:
        if kind == "threading":  # what its threads are at cannot be broken off
            end_now(error)
        raise
