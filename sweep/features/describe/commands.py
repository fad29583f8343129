"""Command that describes a file of curves."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...cli.options import OF_CURVES
from ...cli.output import Json, Quiet, print_answer

PANEL = OF_CURVES


def describe(
    file: Annotated[Path, typer.Argument(help="A file or folder of curves.", show_default=False)],
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for the picture.")] = Path("outputs/describe"),
    quantity: Annotated[
        str | None,
        typer.Option(help="Unit of the numbers; without it, what the heads say, or a guess.", show_default=False),
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Plot and check a file of curves: contents, issues, colors of its lights."""
    from .describe import describe as described

    print_answer(described(file, output=output, quantity=quantity), as_json=as_json, quiet=quiet)
