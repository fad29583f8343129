"""Fit the built-in curves."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from ...base.errors import StudyError
from ..options import StudyPath
from ..panels import OF_TOOL

PANEL = OF_TOOL


def calibrate(
    study: StudyPath,
    output: Annotated[Path, typer.Option(help="Folder for the result.")] = Path("outputs/calibration"),
    seed: Annotated[int, typer.Option(min=0)] = 1,
    starts: Annotated[int, typer.Option(min=1, help="Starting points of each fit.")] = 4,
    jobs: Annotated[int | None, typer.Option(min=1, help="Worker processes.", show_default="all cores")] = None,
) -> None:
    """Fit the built-in surrogate curves to the figures that STUDY publishes."""
    from ...study import load_study
    from ..calibrate import fit_surrogate
    from ..calibrate.output import write
    from ..progress import ProgressDisplay

    loaded = load_study(study)
    geometry = set(loaded.geometry)
    printed = {r: dict(v) for rows in loaded.section.published.values() for r, v in rows.items() if r not in geometry}
    if not printed:
        raise StudyError(f"{study}: the study has no `published` figures to fit to")
    with ProgressDisplay() as display:
        found = fit_surrogate(printed, seed, starts, jobs or os.cpu_count() or 1, display.update)
    for line in write(found, output):
        typer.echo(line)
