"""Commands of files of curves."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from ...base.errors import DataError
from ..options import OF_CURVES, AllowCode, DataFolder, quantity_of
from ..output import Json, Quiet, print_result

PANEL = OF_CURVES


def describe(
    file: Annotated[Path, typer.Argument(help="A file or folder of curves.", show_default=False)],
    output: Annotated[Path, typer.Option(help="Folder for the picture.")] = Path("outputs/describe"),
    quantity: Annotated[
        str | None,
        typer.Option(help="Unit of the numbers; without it, what the heads say, or a guess.", show_default=False),
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Plot and check a file of curves: contents, issues, colors of its lights."""
    facts: dict[str, Any] = {"file": str(file)}
    from ..describe import described

    description = described(file, output, quantity_of(quantity))
    facts |= {**description.facts, "faults": [str(issue) for issue in description.issues]}
    print_result(description.lines, facts, as_json=as_json, quiet=quiet)
    if description.issues:
        raise DataError(description.issues)


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
    sensor: Annotated[str, typer.Option(help="A built-in sensor, or a file of QE curves.")] = "ar0820",
    lights: Annotated[
        str | None, typer.Option(help="tl16, or a file of spectra.", show_default="tl16, or the run's")
    ] = None,
    quantity: Annotated[
        list[str] | None,
        typer.Option(help="Unit of the filter's numbers, or of the lights', where their heads do not tell it."),
    ] = None,
    transmission: Annotated[
        bool,
        typer.Option(
            "--transmission", help="The values are a transmission in front of the clear pixel, or else the brightest."
        ),
    ] = False,
    relative_to: Annotated[
        str | None, typer.Option(help="The values are a transmission times this curve.", show_default=False)
    ] = None,
    design: Annotated[str | None, typer.Option(help="Of a run: design_id, name or best.", show_default="best")] = None,
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
        quantity=[quantity_of(word) for word in quantity or ()],
        transmission=transmission,
        relative_to=relative_to,
        data=data,
        allow_code=allow_code,
    )
    facts = {
        "source": str(source),
        "rows": evaluation.table.to_dict("records") if as_json else [],
        "limit_of": evaluation.goal.name,
        "limit_dn": evaluation.limit,
        "before_quantization_dn": evaluation.before_quantization_dn,
        "gap": evaluation.gap,
        "no_limit": evaluation.no_limit,
        "notes": evaluation.notes,
    }
    print_result([str(evaluation)], facts, as_json=as_json, quiet=quiet)
