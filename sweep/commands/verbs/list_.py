"""List studies."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..options import DataFolder, Outputs
from ..panels import OF_STUDIES

PANEL = OF_STUDIES


def list_(
    folder: Annotated[Path, typer.Argument(help="Folder of the studies.")] = Path("studies"),
    data: DataFolder = None,
    output: Outputs = Path("outputs"),
) -> None:
    """List the studies of a folder: question, number of designs, and whether they have been run."""
    from ..list_studies import list_lines

    for line in list_lines(folder, output, data):
        typer.echo(line)
