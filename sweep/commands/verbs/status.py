"""Say how far a run is."""

from __future__ import annotations

from typing import Annotated

import typer

from ..options import RunFolder
from ..panels import OF_RESULTS

PANEL = OF_RESULTS


def status(
    folder: RunFolder,
    verify: Annotated[bool, typer.Option("--verify", help="Compare the digests of all its files.")] = False,
) -> None:
    """Say how far a run is, from another terminal; of a finished one, which of its files are missing or damaged."""
    from ..status import status_lines

    for line in status_lines(folder, verify=verify):
        typer.echo(line)
