"""Measure what accuracy costs."""

from __future__ import annotations

from pathlib import Path

import typer

from ..options import DataFolder, Outputs, StudyPath
from ..panels import OF_TOOL

PANEL = OF_TOOL


def accuracy(
    study: StudyPath,
    data: DataFolder = None,
    output: Outputs = Path("outputs"),
) -> None:
    """Measure what accuracy costs: tolerances from 100 to 0.001 DN and single settings, with error, time and work."""
    from ...study import folder_name, load_study
    from ..accuracy.ladder import measure_accuracy
    from ..progress import ProgressDisplay

    loaded = load_study(study, data)
    with ProgressDisplay() as display:
        folder = output / folder_name(loaded.name)
        lines = measure_accuracy(loaded, lambda step_nm: load_study(study, data, step_nm), folder, display.update)
    for line in lines:
        typer.echo(line)
