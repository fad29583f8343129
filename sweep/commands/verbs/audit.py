"""Recompute a sample of a run."""

from __future__ import annotations

import typer

from ...base.errors import BrokenPromiseError
from ..options import AllowCode, DataFolder, RunFolder
from ..panels import OF_RESULTS

PANEL = OF_RESULTS


def audit(folder: RunFolder, data: DataFolder = None, allow_code: AllowCode = False) -> None:
    """Compute the front and 1 % of a run's rows again at the reference settings, and compare.

    Exit code 5 says that an error is larger than the study's tolerance allows.
    """
    from ...results.tables import AUDIT
    from ..audit import audit_output
    from ..progress import ProgressDisplay

    with ProgressDisplay() as display:
        found = audit_output(folder, data, display.update, allow_code=allow_code)
    for line in found.lines:
        typer.echo(line)
    typer.echo(f"Files: {folder}/: {AUDIT}.")
    if found.faults:
        raise BrokenPromiseError(found.faults)
