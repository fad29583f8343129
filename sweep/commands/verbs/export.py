"""Write a filter of a run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..options import AllowCode, Also, RunFolder
from ..panels import OF_RESULTS

PANEL = OF_RESULTS


def export(
    folder: RunFolder,
    design: Annotated[str, typer.Option(help="A design_id, a name (RYN_4Cy, RGGB), or best.", show_default=False)],
    data: Annotated[
        Path | None, typer.Option(help="Folder with the run's curve files, which are then read again and compared.")
    ] = None,
    also: Annotated[
        list[Also] | None,
        typer.Option(help="Another file, too: .spectrum of Speos, or weights of the sensor's R, G and B."),
    ] = None,
    to: Annotated[Path | None, typer.Option(help="Folder for the files.", show_default="FOLDER/export")] = None,
    allow_code: AllowCode = False,
) -> None:
    """Write a filter of a finished run as CSV and as ISETCam color filters (.mat), and for other programs."""
    from ..export import export_design

    for line in export_design(folder, design, data, to, also or (), allow_code=allow_code):
        typer.echo(line)
