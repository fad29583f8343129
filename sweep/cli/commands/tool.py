"""Commands of the tool itself."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..options import OF_TOOL, DataFolder, Outputs, StudyPath
from ..output import Json, ProgressDisplay, Quiet, print_answer

PANEL = OF_TOOL


def accuracy(
    study: StudyPath,
    data: DataFolder = None,
    output: Outputs = Path("outputs"),
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Measure what accuracy costs: error and time of each preset, and of steps of the wavelengths, in each scene."""
    from ...report.accuracy import measure_accuracy
    from ...study import Study, folder_name, load_study
    from ...study.shipped import study_path

    path = study_path(study)

    def at_step(step_nm: float | None) -> Study:
        return load_study(path, data, changes={} if step_nm is None else {"wavelengths.step_nm": step_nm})

    with ProgressDisplay(quiet=quiet) as display:
        answer = measure_accuracy(at_step, output / folder_name(at_step(None).name), display.update)
    print_answer(answer, as_json=as_json, quiet=quiet)


def schema(
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="File to write.", show_default="the terminal")
    ] = None,
) -> None:
    """Make the JSON Schema of study files, with which editors complete and check them."""
    from ...api.new import write_schema
    from ...study.editors import schema_text

    if output is None:
        typer.echo(schema_text(), nl=False)
        return
    write_schema(output)
    typer.echo(f"Schema: {output}. A study beside it names it in its first line:")
    typer.echo(f"# yaml-language-server: $schema={output.name}")
