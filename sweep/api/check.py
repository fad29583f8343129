"""Check a study, and say which effects its scenes call for, without running it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..base.answer import Answer
from ..base.errors import StudyError, ValidationIssue
from ..study import SensorAndLights, load_study, sensor_studies_in
from ..study.goals import refuse_unreachable
from ..study.shipped import study_path

Changes = Mapping[str, Any] | None
"""Keys of a study, dotted, and their values instead of the file's."""


def check(
    study: Path | str, data: Path | str | None = None, *, changes: Changes = None, allow_code: bool = False
) -> Answer:
    """Check a study file and count its designs.

    Parameters
    ----------
    study : path-like
        A study file, or the name of a study.
    data : path-like, optional
        Folder in which the study's files are looked for first.
    changes : mapping of str to object
        Keys of the study, ``"constraints.sensitivity.min"``, and values instead of the file's.
    allow_code : bool
        Permit the code that the study names to run.

    Returns
    -------
    Answer
        Number of designs, CFAs and notes.

    Raises
    ------
    SweepError
        With one line per issue: file, line, key, value, allowed values and nearest name.
    """
    path, folder, changes = study_path(Path(study)), None if data is None else Path(data), changes or {}
    several = sensor_studies_in(path, changes)
    members: tuple[SensorAndLights | None, ...] = (None,) if several is None else several.members
    lines, facts = list[str](), list[dict[str, object]]()
    for member in members:
        loaded = load_study(path, folder, changes=changes, allow_code=allow_code, member=member)
        refuse_unreachable(loaded)
        which = "" if member is None else f"{member.name}: "
        mosaics = ", ".join(loaded.mosaics)
        lines.append(f"{path}: {which}{loaded.n_designs:,} designs on {mosaics}; nothing wrong found.")
        lines += [f"Note: {warning}." for warning in loaded.warnings]
        counts = {"designs": loaded.n_designs, "filters": loaded.n_filters, "scenarios": [*loaded.scenarios]}
        facts.append({"study": loaded.name, **counts, "cfas": [*loaded.mosaics], "warnings": loaded.warnings})
    return Answer(lines, {"file": str(path), "studies": facts})


def plan(
    study: Path | str,
    data: Path | str | None = None,
    *,
    tolerance_dn: float | None = None,
    changes: Changes = None,
    allow_code: bool = False,
) -> Answer:
    """Say which effects each scene calls for, and why.

    Parameters
    ----------
    study, data, changes, allow_code
        As for `check`.
    tolerance_dn : float, optional
        Tolerance of a CSD, DN; left out, that of the study.

    Returns
    -------
    Answer
        Each effect of each scene: whether it is computed, and a bound on what it changes; what all that is left out
        changes at most, and how much time that saves; as a mapping in ``facts``.

    Raises
    ------
    SweepError
        As `check`, and for a tolerance that is none.
    """
    from ..report.scenes import plan_facts, plan_lines  # noqa: PLC0415  (tables of pandas: few need them)
    from ..runs.dry_run import seconds_of_effects  # noqa: PLC0415

    if tolerance_dn is not None and not 0 < tolerance_dn < math.inf:
        raise StudyError(ValidationIssue("no tolerance", None, None, "--tolerance", tolerance_dn, "above 0 DN, finite"))
    folder = None if data is None else Path(data)
    loaded = load_study(study_path(Path(study)), folder, changes=changes or {}, allow_code=allow_code)
    planned = loaded.with_plans(tolerance_dn)
    notes = [f"Note: {warning}." for warning in loaded.warnings]
    seconds = seconds_of_effects(planned)
    return Answer([*notes, *plan_lines(planned, seconds)], plan_facts(planned, seconds))
