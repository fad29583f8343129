"""What a run ends with: figures, the report, and a few lines for a person."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from ..base.types import Parallel


def finish(folder: Path, began_s: float, *, mend: bool = False, parallel: Parallel | None = None) -> None:
    """Draw figures and report of a finished run, and say what it found; `mend`: only what is missing or damaged.

    `began_s`: when the command began, by the monotonic clock: a user waits for the report, too. `parallel` makes the
    pictures, without it they are made one after the other.
    """
    from ..base.errors import BrokenPromiseError, Fault
    from ..base.types import in_turn
    from ..report import make_report, read_output, summary_lines

    found = read_output(folder)
    make_report(found, mend=mend, parallel=parallel or in_turn)
    for line in summary_lines(found, time.monotonic() - began_s):
        typer.echo(line)
    check = found.provenance.check
    if check is not None and not check.passed:
        raise BrokenPromiseError([Fault(check.sentence.removesuffix("."), key=check.scenario)])
