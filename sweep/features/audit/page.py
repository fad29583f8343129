"""What an audit found, as a line of the method."""

from __future__ import annotations

from ...report.numbers import digits
from ...report.run import Run
from ...report.sections import Pairs
from . import AUDIT


def audited(run: Run) -> Pairs:
    """Return the largest error of all scenes."""
    of = run.output.tables.get(AUDIT)
    return [] if of is None else [("audited", f"all scenes: at most {digits(float(of['realized_dn'].max()))} DN")]


METHOD = {"audit": audited}
