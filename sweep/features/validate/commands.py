"""Command that compares readings of the bench with a study."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...base.errors import SweepError, ValidationIssue
from ...cli.options import OF_STUDIES, AllowCode, Changes, DataFolder, StudyPath, changes_of
from ...cli.output import Json, Quiet, print_answer

PANEL = OF_STUDIES


def validate(
    study: StudyPath,
    readings: Annotated[
        Path | None, typer.Argument(help="Table of digital numbers, a row a reading.", show_default=False)
    ] = None,
    template: Annotated[
        Path | None, typer.Option(help="New table of the study's lamps, for numbers to be filled in.")
    ] = None,
    cfa: Annotated[str | None, typer.Option(help="CFA of the camera.", show_default="the first that fits")] = None,
    hold: Annotated[
        list[str] | None,
        typer.Option(help="black, gain, shift, crosstalk or read_noise, to stay as the study says; may be repeated."),
    ] = None,
    corrected: Annotated[Path | None, typer.Option(help="New file for the curves behind the shifted IR cut.")] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Folder for the page.", show_default="outputs/validate-NAME")
    ] = None,
    changes: Changes = None,
    data: DataFolder = None,
    allow_code: AllowCode = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Compare readings of a camera on the bench with a study."""
    from .validate import bench_template
    from .validate import validate as validated

    if template is not None:
        made = bench_template(study, template, changes=changes_of(changes), data=data, allow_code=allow_code)
        print_answer(made, as_json=as_json, quiet=quiet)
        return
    if readings is None:
        raise SweepError(
            ValidationIssue("missing", key="READINGS", allowed="a table, or --template FILE for a new one")
        )
    answer = validated(
        study,
        readings,
        cfa=cfa,
        hold=hold or (),
        output=output,
        corrected=corrected,
        changes=changes_of(changes),
        data=data,
        allow_code=allow_code,
    )
    print_answer(answer, as_json=as_json, quiet=quiet)
