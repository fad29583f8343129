"""Describe a file of curves."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...base.errors import DataError
from ...curves.light_unit import LightUnit
from ..panels import OF_CURVES
from ..said import Json, Quiet, say

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
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Plot and check a file of curves: what it holds, what is wrong with it, which colors its lights have."""
    if file.suffix.casefold() == ".xml" and clean is None and quantity is None:
        from ..emva1288 import pixel_lines

        lines = list(pixel_lines(file))
        say(lines, {"file": str(file), "lines": lines}, as_json=as_json, quiet=quiet)
        return
    from ..describe import cleaned, described

    if clean is not None:
        lines = cleaned(file, clean)
        say(lines, {"file": str(file), "clean": str(clean), "lines": lines}, as_json=as_json, quiet=quiet)
        return
    found = described(file, output, quantity)
    facts = {"file": str(file), **found.facts, "faults": [str(fault) for fault in found.faults]}
    say(found.lines, facts, as_json=as_json, quiet=quiet)
    if found.faults:
        raise DataError(found.faults)
