"""Check a study."""

from __future__ import annotations

import typer

from ..options import AllowCode, Changes, DataFolder, StudyPath, changes_of
from ..panels import OF_STUDIES

PANEL = OF_STUDIES


def check(study: StudyPath, data: DataFolder = None, changes: Changes = None, allow_code: AllowCode = False) -> None:
    """Check a study file and count its designs, without running it."""
    from ...study import load_study
    from ...study.reach import likely_percents, out_of_reach

    loaded = load_study(study, data, changes=changes_of(changes), allow_code=allow_code)
    typer.echo(f"{study}: {loaded.n_designs:,} designs on {', '.join(loaded.mosaics)}; nothing wrong found.")
    reach = [] if loaded.search is None else out_of_reach(loaded, loaded.search.space, loaded.search.scenario)
    for warning in (*loaded.warnings, *likely_percents(loaded), *reach):
        typer.echo(f"Note: {warning}.")
