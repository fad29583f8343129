"""The arguments and options that several commands share."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from ..base.errors import Fault, StudyError
from .completion import run_folders, study_files


class Also(StrEnum):
    """Files of other programs that an export can write, too."""

    SPEOS = "speos"
    RGB = "rgb"


def _found(path: Path) -> Path:
    from ..study.shipped import study_path  # noqa: PLC0415  (help needs no study)

    return study_path(path)


def _all_found(paths: list[Path]) -> list[Path]:
    return [_found(path) for path in paths]


_STUDY = "A study file, YAML, or the name of a study as `sweep list` has it."
StudyPath = Annotated[
    Path, typer.Argument(help=_STUDY, show_default=False, autocompletion=study_files, callback=_found)
]
StudyPaths = Annotated[
    list[Path], typer.Argument(help=_STUDY, show_default=False, autocompletion=study_files, callback=_all_found)
]
Changes = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="A key of the study: constraints.sensitivity.min=0.92."),
]

AllowCode = Annotated[
    bool,
    typer.Option(
        "--allow-code", help="Run the code that the study names: Python files and what installed packages offer."
    ),
]


def changes_of(given: list[str] | None) -> dict[str, str]:
    """Dotted keys and values of `--set`; raises StudyError for what is no KEY=VALUE."""
    found = {}
    for text in given or ():
        key, mark, value = text.partition("=")
        if not mark or not all(key.split(".")):
            raise StudyError(
                Fault("not KEY=VALUE", key="--set", value=text, allowed="constraints.sensitivity.min=0.92")
            )
        found[key] = value
    return found


RunFolder = Annotated[
    Path, typer.Argument(help="Output folder of a study.", show_default=False, autocompletion=run_folders)
]
Outputs = Annotated[Path, typer.Option(help="Folder for the results of all studies.")]
DataFolder = Annotated[
    Path | None, typer.Option("--data", help="Folder that the study's files are looked for in first.")
]
