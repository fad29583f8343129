"""Draw a report again."""

from __future__ import annotations

from ..finish import finish
from ..options import RunFolder
from ..panels import RESULTS

PANEL = RESULTS


def report(folder: RunFolder) -> None:
    """Draw figures and report of a finished run again."""
    finish(folder)
