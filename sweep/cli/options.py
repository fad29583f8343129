"""Arguments and options that several commands share, completion for the shell, and groups of the help."""

from __future__ import annotations

import os
from glob import escape
from pathlib import Path
from typing import Annotated

import typer

from ..base.errors import StudyError, ValidationIssue

OF_STUDIES = "Studies"
OF_RESULTS = "Results"
OF_CURVES = "Files of curves"
OF_TOOL = "The tool itself"
PANELS = (OF_STUDIES, OF_RESULTS, OF_CURVES, OF_TOOL)
"""Groups of commands in the help, in order."""


def study_files(incomplete: str) -> list[str]:
    """Complete the path of a study file.

    Returns completions, down to one folder below.
    """
    return sorted(_paths(incomplete, ("*.yaml", "*.yml", "*/*.yaml", "*/*.yml")))


def run_folders(incomplete: str) -> list[str]:
    """Complete the path of a run's folder.

    Returns completions, down to one folder below.
    """
    patterns = ("*/manifest.json", "*/*/manifest.json")
    return sorted({str(Path(path).parent) for path in _paths(incomplete, patterns)})


def _paths(incomplete: str, patterns: tuple[str, ...]) -> set[str]:
    """Globbing from the last whole folder keeps a path as its user writes it."""
    folder, typed = os.path.split(incomplete)
    return {str(path) for pattern in patterns for path in Path(folder).glob(escape(typed) + pattern)}


def changes_of(texts: list[str] | None) -> dict[str, str]:
    """Parse the values of `--set`.

    `texts`: `KEY=VALUE` texts. Raises StudyError if a text is not KEY=VALUE.
    """
    changes = {}
    for text in texts or ():
        key, mark, value = text.partition("=")
        if not mark or not all(key.split(".")):
            raise StudyError(
                ValidationIssue("not KEY=VALUE", key="--set", value=text, allowed="constraints.sensitivity.min=0.92")
            )
        changes[key] = value
    return changes


_STUDY = "A study file, YAML, or the name of a study as `sweep list` has it."
StudyPath = Annotated[Path, typer.Argument(help=_STUDY, show_default=False, autocompletion=study_files)]
StudyPaths = Annotated[list[Path], typer.Argument(help=_STUDY, show_default=False, autocompletion=study_files)]
Changes = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="A key of the study: constraints.sensitivity.min=0.92."),
]
AllowCode = Annotated[
    bool,
    typer.Option(
        "--allow-code", help="Run the code that the study names: Python files and plugins of installed packages."
    ),
]
RunFolder = Annotated[
    Path, typer.Argument(help="Output folder of a study.", show_default=False, autocompletion=run_folders)
]
Outputs = Annotated[Path, typer.Option("--output", "-o", help="Folder for the results of all studies.")]
Jobs = Annotated[
    int | None, typer.Option("--jobs", "-j", min=1, help="Workers: processes at once.", show_default="all cores")
]
Force = Annotated[bool, typer.Option("--force", "-f", help="Replace files of other content.")]
Design = Annotated[
    str | None, typer.Option("--design", help="A filter_id, a name (paper_N4, RGGB), or best.", show_default=False)
]
Designs = Annotated[
    list[str] | None,
    typer.Option(
        "--design", help="A filter_id, a name (paper_N4, RGGB), or best; may be repeated.", show_default=False
    ),
]
Quantities = Annotated[
    list[str] | None,
    typer.Option("--quantity", help="Unit of the files' numbers, where heads do not tell it; may be repeated."),
]
DataFolder = Annotated[
    Path | None, typer.Option("--data", help="Folder that the study's files are looked for in first.")
]
