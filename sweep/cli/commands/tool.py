"""Commands of the tool itself."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..options import OF_TOOL, DataFolder, Outputs, StudyPath
from ..output import ProgressDisplay

PANEL = OF_TOOL


def accuracy(study: StudyPath, data: DataFolder = None, output: Outputs = Path("outputs")) -> None:
    """Measure what accuracy costs: error and time of each preset, in each scene of a study."""
    from ...study import folder_name, load_study
    from ..accuracy import measure_accuracy

    loaded = load_study(study, data)
    folder = output / folder_name(loaded.name)
    with ProgressDisplay() as display:
        lines = measure_accuracy(loaded, folder, display.update)
    for line in lines:
        typer.echo(line)


def schema(
    output: Annotated[Path | None, typer.Option(help="File to write.", show_default="the terminal")] = None,
) -> None:
    """Make the JSON Schema of study files, with which editors complete and check them."""
    from ...study.editors import schema_text
    from ..new import write_schema

    if output is None:
        typer.echo(schema_text(), nl=False)
        return
    write_schema(output)
    typer.echo(f"Schema: {output}. A study beside it names it in its first line:")
    typer.echo(f"# yaml-language-server: $schema={output.name}")
