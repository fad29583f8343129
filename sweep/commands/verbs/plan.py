"""Say how scenes are simulated."""

from __future__ import annotations

import math
from typing import Annotated

import typer

from ...base.errors import StudyError
from ..options import AllowCode, Changes, DataFolder, StudyPath, changes_of
from ..panels import OF_STUDIES
from ..said import Json, Quiet, say

PANEL = OF_STUDIES


def plan(
    study: StudyPath,
    data: DataFolder = None,
    tolerance: Annotated[float | None, typer.Option(help="Tolerance of a CSD, DN.", show_default="the study's")] = None,
    changes: Changes = None,
    allow_code: AllowCode = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Say which effects each scene calls for, and why, without running it."""
    from ...report.scenes import plan_facts, plan_lines
    from ...study import load_study

    if tolerance is not None and not 0 < tolerance < math.inf:
        raise StudyError(f"--tolerance {tolerance:g}: must be above 0 DN, and finite")
    loaded = load_study(study, data, changes=changes_of(changes), allow_code=allow_code)
    planned = loaded.with_plans(tolerance)
    notes = [f"Note: {warning}." for warning in loaded.warnings]
    say([*notes, *plan_lines(planned)], plan_facts(planned), as_json=as_json, quiet=quiet)
