"""Begin a study."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...curves.light_unit import LightUnit
from ..panels import OF_STUDIES

PANEL = OF_STUDIES


def new(
    name: Annotated[str, typer.Argument(help="Name of the study and of its file.", show_default=False)],
    qe: Annotated[Path | None, typer.Option(help="QE curves of a sensor, .csv or .mat.", show_default=False)] = None,
    lights: Annotated[Path | None, typer.Option(help="Spectra of lights, .csv or .mat.", show_default=False)] = None,
    quantity: Annotated[LightUnit, typer.Option(help="What the lights' numbers are.")] = "energy",
    folder: Annotated[Path, typer.Option(help="Folder of the studies.")] = Path("studies"),
) -> None:
    """Write a commented study that runs as it is, for the built-in curves or for files of your own."""
    from ..new import new_study

    for line in new_study(name, folder, qe, lights, quantity):
        typer.echo(line)
