"""Command that compares finished runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...cli.options import OF_RESULTS, run_folders
from ...cli.output import Json, Quiet, print_answer

PANEL = OF_RESULTS


def compare(
    folders: Annotated[
        list[Path],
        typer.Argument(help="Output folders of two or more studies.", show_default=False, autocompletion=run_folders),
    ],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Folder for the comparison.", show_default="outputs/compare-A-B"),
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Compare finished runs: studies, best designs, fronts, versions."""
    from .compare import compare as compared

    print_answer(compared(folders, output=output), as_json=as_json, quiet=quiet)
