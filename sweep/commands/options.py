"""The arguments and options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .completion import run_folders, study_files

StudyPath = Annotated[
    Path, typer.Argument(help="The study file, YAML.", show_default=False, autocompletion=study_files)
]
RunFolder = Annotated[
    Path, typer.Argument(help="Output folder of a study.", show_default=False, autocompletion=run_folders)
]
Outputs = Annotated[Path, typer.Option(help="Folder for the results of all studies.")]
DataFolder = Annotated[
    Path | None, typer.Option("--data", help="Folder that the study's files are looked for in first.")
]
