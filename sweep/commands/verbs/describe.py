"""Describe a file of curves."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...base.errors import DataError
from ...curves.light_unit import LightUnit
from ..panels import OF_CURVES

PANEL = OF_CURVES


def describe(
    file: Annotated[Path, typer.Argument(help="A file of curves, or EMVA 1288 results (.xml).", show_default=False)],
    output: Annotated[Path, typer.Option(help="Folder for the picture.")] = Path("outputs/describe"),
    quantity: Annotated[
        LightUnit | None,
        typer.Option(help="Of light spectra; without it, lights or QE is guessed.", show_default=False),
    ] = None,
    clean: Annotated[
        Path | None,
        typer.Option(help="Write clean CSV here; it says what was changed.", show_default=False),
    ] = None,
) -> None:
    """Plot and check a file of curves: what it holds, what is wrong with it, which colors its lights have."""
    if file.suffix.casefold() == ".xml" and clean is None and quantity is None:
        from ..emva1288 import pixel_lines

        for line in pixel_lines(file):
            typer.echo(line)
        return
    from ..describe import cleaned, described

    if clean is not None:
        for line in cleaned(file, clean):
            typer.echo(line)
        return
    found = described(file, output, quantity)
    for line in found.lines:
        typer.echo(line)
    if found.faults:
        raise DataError(found.faults)
