"""Compare runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..completion import run_folders
from ..panels import OF_RESULTS
from ..said import Json, Quiet, say

PANEL = OF_RESULTS


def compare(
    folders: Annotated[
        list[Path],
        typer.Argument(help="Output folders of two or more studies.", show_default=False, autocompletion=run_folders),
    ],
    output: Annotated[
        Path | None, typer.Option(help="Folder for the comparison.", show_default="outputs/compare-A-B")
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Compare finished runs: what their studies ask, best designs, fronts, versions."""
    from ...report.compare import compare_runs

    compared = compare_runs(folders, output)
    facts = {name: table.to_dict("records") for name, table in compared.tables.items()} if as_json else {}
    say(
        compared.lines, {"folder": str(compared.folder), **facts, "notes": compared.notes}, as_json=as_json, quiet=quiet
    )
