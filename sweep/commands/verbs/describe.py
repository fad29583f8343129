"""Describe a file of curves."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...curves.light_unit import LightUnit
from ...errors import DataError
from ..panels import OF_CURVES

PANEL = OF_CURVES


def describe(
    file: Annotated[Path, typer.Argument(help="A file of curves, .csv or .mat.", show_default=False)],
    output: Annotated[Path, typer.Option(help="Folder for the picture.")] = Path("outputs/describe"),
    quantity: Annotated[
        LightUnit | None,
        typer.Option(help="Of light spectra; without it, lights or QE is guessed.", show_default=False),
    ] = None,
) -> None:
    """Plot and check a file of curves: what it holds, what is wrong with it, which colors its lights have."""
    from ..describe import described

    found = described(file, output, quantity)
    for line in found.lines:
        typer.echo(line)
    if found.faults:
        raise DataError(found.faults)
