"""Check a study."""

from __future__ import annotations

import typer

from ..options import DataFolder, StudyPath
from ..panels import OF_STUDIES

PANEL = OF_STUDIES


def check(study: StudyPath, data: DataFolder = None) -> None:
    """Check a study file and count its designs, without running it."""
    from ...study import load_study

    loaded = load_study(study, data)
    typer.echo(f"{study}: {loaded.n_designs:,} designs on {', '.join(loaded.mosaics)}; nothing wrong found.")
    for warning in loaded.warnings:
        typer.echo(f"Note: {warning}.")
