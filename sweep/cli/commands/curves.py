"""Commands of files of curves."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..options import OF_CURVES, AllowCode, DataFolder, Design, Quantities
from ..output import Json, Quiet, print_answer

PANEL = OF_CURVES


def evaluate_(
    source: Annotated[
        Path,
        typer.Argument(
            help="A file with the filter's curve, a folder of such files, or that of a run.", show_default=False
        ),
    ],
    channel: Annotated[
        str | None, typer.Option(help="Channel of the filter.", show_default="the one without a curve")
    ] = None,
    cfa: Annotated[
        str | None, typer.Option(help="CFA by its name.", show_default="RYNCy, or one that the sensor allows")
    ] = None,
    base: Annotated[
        str | None, typer.Option(help="Curve that it replaces.", show_default="that diagonal to it")
    ] = None,
    column: Annotated[
        str | None, typer.Option(help="Column of the file.", show_default="the only one, or CHANNEL")
    ] = None,
    sensor: Annotated[
        str | None, typer.Option(help="A built-in sensor, or a file of QE curves.", show_default="ar0820")
    ] = None,
    lights: Annotated[
        str | None, typer.Option(help="tl16, or a file of spectra.", show_default="tl16, or the run's")
    ] = None,
    quantity: Quantities = None,
    transmission: Annotated[
        bool,
        typer.Option(
            "--transmission", help="The values are a transmission in front of the clear pixel, or else the brightest."
        ),
    ] = False,
    relative_to: Annotated[
        str | None, typer.Option(help="The values are a transmission times this curve.", show_default=False)
    ] = None,
    design: Design = None,
    data: DataFolder = None,
    allow_code: AllowCode = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Evaluate a filter from a file or a run: its CSDs and light beside RGGB, and its gap to the upper bound."""
    from ...api.evaluate import evaluate

    evaluation = evaluate(
        source,
        design=design,
        channel=channel,
        cfa=cfa,
        base=base,
        column=column,
        sensor=sensor,
        lights=lights,
        quantity=quantity,
        transmission=transmission,
        relative_to=relative_to,
        data=data,
        allow_code=allow_code,
    )
    print_answer(evaluation, as_json=as_json, quiet=quiet)
