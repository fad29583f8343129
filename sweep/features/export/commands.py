"""Command that writes filters of finished runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...base.errors import SweepError, ValidationIssue
from ...cli.options import OF_RESULTS, AllowCode, Designs, Force, RunFolder
from ...cli.output import Json, Quiet, print_answer

PANEL = OF_RESULTS


def export(
    folder: RunFolder,
    design: Designs = None,
    data: Annotated[
        Path | None, typer.Option(help="Folder with the run's curve files, which are then read again and compared.")
    ] = None,
    specification: Annotated[
        bool, typer.Option("--specification", help="Also what an absorption band of the study's map would have to be.")
    ] = False,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Folder for the files.", show_default="FOLDER/export")
    ] = None,
    allow_code: AllowCode = False,
    force: Force = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Write a filter of a finished run as CSV and as ISETCam color filters (.mat)."""
    if not design:
        raise SweepError(ValidationIssue("missing", key="--design", allowed="--design best, or a name"))
    from .export import export as exported

    answer = exported(
        folder, design, data, output=output, specification=specification, allow_code=allow_code, force=force
    )
    print_answer(answer, as_json=as_json, quiet=quiet)
