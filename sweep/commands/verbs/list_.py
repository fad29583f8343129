"""List studies, or the spectra that the package ships."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..options import DataFolder, Outputs
from ..panels import OF_STUDIES
from ..said import Json, Quiet, say

PANEL = OF_STUDIES


def list_(
    folder: Annotated[
        str, typer.Argument(help="Folder of the studies; `data` lists the spectra of the package instead.")
    ] = "studies",
    data: DataFolder = None,
    output: Outputs = Path("outputs"),
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """List the studies of a folder: question, number of designs, and whether they have been run.

    `sweep list data` lists the spectra that the package ships; a folder of that name is `./data`.
    """
    if folder == "data":
        from ..list_data import data_facts, data_lines

        say(data_lines(), data_facts(), as_json=as_json, quiet=quiet)
    else:
        from ..list_studies import list_facts, list_lines, studies_of

        studies = studies_of(Path(folder), output, data)
        say(list_lines(Path(folder), studies), list_facts(studies), as_json=as_json, quiet=quiet)
