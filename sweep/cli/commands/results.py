"""Commands of the results of runs."""

from __future__ import annotations

from typing import Annotated

import typer

from ..options import OF_RESULTS, RunFolder
from ..output import Json, Quiet, print_answer

PANEL = OF_RESULTS


def open_(folder: RunFolder, as_json: Json = False, quiet: Quiet = False) -> None:
    """Open the report of a finished run in the browser."""
    from ...api.run import show

    print_answer(show(folder), as_json=as_json, quiet=quiet)


def report(context: typer.Context, folder: RunFolder, as_json: Json = False, quiet: Quiet = False) -> None:
    """Draw figures and report of a finished run again."""
    from ...api.run import report as drawn

    print_answer(drawn(folder, began_s=context.find_root().obj), as_json=as_json, quiet=quiet)


def status(
    folder: RunFolder,
    verify: Annotated[bool, typer.Option("--verify", help="Compare the digests of all its files.")] = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Say how far a run is, from another terminal; of a finished one, which of its files are missing or damaged."""
    from ...runs.status import status as status_of

    print_answer(status_of(folder, verify=verify), as_json=as_json, quiet=quiet)
