"""Recompute a sample of a run."""

from __future__ import annotations

from ...base.errors import BrokenPromiseError
from ..options import AllowCode, DataFolder, RunFolder
from ..panels import OF_RESULTS
from ..said import Json, Quiet, say

PANEL = OF_RESULTS


def audit(
    folder: RunFolder,
    data: DataFolder = None,
    allow_code: AllowCode = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Compute the front and 1 % of a run's rows again at the reference settings, and compare.

    Exit code 5 says that an error is larger than the study's tolerance allows.
    """
    from ...results.tables import AUDIT
    from ..audit import audit_output
    from ..progress import ProgressDisplay

    with ProgressDisplay(quiet=quiet) as display:
        found = audit_output(folder, data, display.update, allow_code=allow_code)
    facts = {"folder": str(folder), "designs": found.n_designs, "rows": found.rows.to_dict("records")}
    say([*found.lines, f"Files: {folder}/: {AUDIT}."], facts, as_json=as_json, quiet=quiet)
    if found.faults:
        raise BrokenPromiseError(found.faults)
