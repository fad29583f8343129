"""List studies, or the spectra that the package ships."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..options import DataFolder, Outputs
from ..panels import OF_STUDIES

PANEL = OF_STUDIES


def list_(
    folder: Annotated[
        str, typer.Argument(help="Folder of the studies; `data` lists the spectra of the package instead.")
    ] = "studies",
    data: DataFolder = None,
    output: Outputs = Path("outputs"),
) -> None:
    """List the studies of a folder: question, number of designs, and whether they have been run.

    `sweep list data` lists the spectra that the package ships; a folder of that name is `./data`.
    """
    if folder == "data":
        from ..list_data import data_lines

        lines = data_lines()
    else:
        from ..list_studies import list_lines

        lines = list_lines(Path(folder), output, data)
    for line in lines:
        typer.echo(line)
