"""Describe a file of curves."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...errors import DataError
from ..options import Quantity
from ..panels import CURVES

PANEL = CURVES


def describe(
    file: Annotated[Path, typer.Argument(help="A file of curves, .csv or .mat.", show_default=False)],
    output: Annotated[Path, typer.Option(help="Folder for the picture.")] = Path("outputs/describe"),
    quantity: Annotated[
        Quantity | None, typer.Option(help="Of light spectra; without it, lights or QE is guessed.", show_default=False)
    ] = None,
) -> None:
    """Plot and check a file of curves: what it holds, what is wrong with it, which colors its lights have."""
    from ..describe import describe as described

    found = described(file, output, quantity)
    for line in found.lines:
        typer.echo(line)
    if found.faults:
        raise DataError(found.faults)
