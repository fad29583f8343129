"""Commands of the results of runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..options import (
    OF_RESULTS,
    AllowCode,
    DataFolder,
    RunFolder,
)
from ..output import Json, ProgressDisplay, Quiet, print_answer

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
    from ...runs.audit import audit as audited

    with ProgressDisplay(quiet=quiet) as display:
        answer = audited(folder, data, allow_code=allow_code, progress=display.update)
    print_answer(answer, as_json=as_json, quiet=quiet)


def open_(folder: RunFolder, as_json: Json = False, quiet: Quiet = False) -> None:
    """Open the report of a finished run in the browser."""
    from ...api.run import show

    print_answer(show(folder), as_json=as_json, quiet=quiet)


def score(
    folder: RunFolder,
    predictions: Annotated[
        list[Path],
        typer.Argument(
            help="CSV or Parquet: image_id, and state or a probability of each; or detections in streets: "
            "results of COCO (.json), or a folder of them.",
            show_default=False,
        ),
    ],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Folder of the scores.", show_default="FOLDER/scores")
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Score readers of a benchmark's test images: errors of each CFA, differences, distance from the ideal observer."""
    from ...report.scores import score as scored

    print_answer(scored(folder, predictions, output=output), as_json=as_json, quiet=quiet)


def report(context: typer.Context, folder: RunFolder, as_json: Json = False, quiet: Quiet = False) -> None:
    """Draw figures and report of a finished run again."""
    from ...api.run import report as drawn

    print_answer(drawn(folder, began_s=context.find_root().obj), as_json=as_json, quiet=quiet)


def status(
    folder: RunFolder,
    verify: Annotated[bool, typer.Option("--verify", help="Compare the digests of all its files.")] = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Say how far a run is, from another terminal; of a finished one, which of its files are missing or damaged."""
    from ...runs.status import status as status_of

    print_answer(status_of(folder, verify=verify), as_json=as_json, quiet=quiet)
