"""Measure what accuracy costs."""

from __future__ import annotations

from pathlib import Path

import typer

from ..options import DataFolder, Outputs, StudyPath
from ..panels import OF_TOOL

PANEL = OF_TOOL


def accuracy(study: StudyPath, data: DataFolder = None, output: Outputs = Path("outputs")) -> None:
    """Measure what accuracy costs: error and time of presets and single settings, in each scene of a study."""
    from ...study import folder_name, load_study
    from ..accuracy import measure_accuracy
    from ..progress import ProgressDisplay

    loaded = load_study(study, data)
    folder = output / folder_name(loaded.name)
    with ProgressDisplay() as display:
        lines = measure_accuracy(loaded, lambda step_nm: load_study(study, data, step_nm), folder, display.update)
    for line in lines:
        typer.echo(line)
