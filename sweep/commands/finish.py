"""What a run ends with: figures, the report, and a few lines for a person."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .said import say_to

if TYPE_CHECKING:
    from ..base.types import Parallel

_TOLD = ("filters", "designs", "failed", "duration_s", "search", "check", "warnings")
"""Keys of provenance that `--json` repeats."""


def finish(
    folder: Path,
    began_s: float,
    *,
    mend: bool = False,
    parallel: Parallel | None = None,
    as_json: bool = False,
    quiet: bool = False,
) -> dict[str, Any]:
    """Draw figures and report of a finished run, and say what it found; the same as plain values.

    `mend`: draw only what is missing or damaged. Raises BrokenPromiseError where the run's check failed.

    `began_s`: when the command began, by the monotonic clock: a user waits for the report, too. `parallel` makes the
    pictures, without it they are made one after the other.
    """
    from ..base.errors import BrokenPromiseError, Fault
    from ..base.types import in_turn
    from ..report import make_report, read_output, summary_lines

    found = read_output(folder)
    make_report(found, mend=mend, parallel=parallel or in_turn)
    say_to(summary_lines(found, time.monotonic() - began_s), as_json=as_json, quiet=quiet)
    check = found.provenance.check
    if check is not None and not check.passed:
        raise BrokenPromiseError([Fault(check.sentence.removesuffix("."), key=check.scenario)])
    facts = found.provenance.model_dump(mode="json")
    return {"folder": str(folder), **{key: facts[key] for key in _TOLD}}
