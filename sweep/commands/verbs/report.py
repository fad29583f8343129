"""Draw a report again."""

from __future__ import annotations

import time

from ..finish import finish
from ..options import RunFolder
from ..panels import OF_RESULTS

PANEL = OF_RESULTS


def report(folder: RunFolder) -> None:
    """Draw figures and report of a finished run again."""
    finish(folder, time.monotonic())
