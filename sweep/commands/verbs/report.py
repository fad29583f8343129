"""Draw a report again."""

from __future__ import annotations

import typer

from ..finish import finish
from ..options import RunFolder
from ..panels import OF_RESULTS

PANEL = OF_RESULTS


def report(context: typer.Context, folder: RunFolder) -> None:
    """Draw figures and report of a finished run again."""
    finish(folder, context.find_root().obj)
