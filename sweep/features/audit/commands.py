"""Command of audits."""

from __future__ import annotations

from ...cli.options import OF_RESULTS, AllowCode, DataFolder, RunFolder
from ...cli.output import Json, ProgressDisplay, Quiet, print_answer

PANEL = OF_RESULTS


def audit(
    folder: RunFolder,
    data: DataFolder = None,
    allow_code: AllowCode = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Compute the front and 1 % of a run's rows again at the reference settings, and compare.

    Exit code 5 says that an error is larger than the study's tolerance allows.
    """
    from .audit import audit as audited

    with ProgressDisplay(quiet=quiet) as display:
        answer = audited(folder, data, allow_code=allow_code, progress=display.update)
    print_answer(answer, as_json=as_json, quiet=quiet)
