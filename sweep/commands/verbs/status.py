"""Say how far a run is."""

from __future__ import annotations

from typing import Annotated

import typer

from ..options import RunFolder
from ..panels import OF_RESULTS
from ..said import Json, Quiet, say

PANEL = OF_RESULTS


def status(
    folder: RunFolder,
    verify: Annotated[bool, typer.Option("--verify", help="Compare the digests of all its files.")] = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Say how far a run is, from another terminal; of a finished one, which of its files are missing or damaged."""
    from ..status import status_of

    status = status_of(folder, verify=verify)
    say(status.lines, status.facts, as_json=as_json, quiet=quiet)
