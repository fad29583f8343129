"""Measure what accuracy costs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..options import DataFolder, Outputs, StudyPath
from ..panels import OF_TOOL

PANEL = OF_TOOL


def accuracy(
    study: StudyPath,
    data: DataFolder = None,
    output: Outputs = Path("outputs"),
    shipped: Annotated[
        bool, typer.Option("--shipped", help="Also what plans cost and save in the shipped studies.")
    ] = False,
) -> None:
    """Measure what accuracy costs: tolerances from 100 to 0.001 DN and single settings, with error, time and work."""
    from ...base.errors import StudyError
    from ...study import folder_name, load_study
    from ...study.shipped import shipped_names, study_path
    from ..accuracy.ladder import measure_accuracy
    from ..progress import ProgressDisplay

    loaded, others, left_out = load_study(study, data), [], []
    for name in shipped_names() if shipped else []:
        try:
            other = load_study(study_path(Path(name)), data)
        except StudyError:  # its data files are not here
            left_out.append(name)
        else:
            others += [other] if other.name != loaded.name else []
    with ProgressDisplay() as display:
        folder = output / folder_name(loaded.name)
        lines = measure_accuracy(
            loaded, lambda step_nm: load_study(study, data, step_nm), folder, display.update, others=others
        )
    if left_out:
        lines.append(f"Not measured, since they cannot be loaded here: {', '.join(left_out)}.")
    for line in lines:
        typer.echo(line)
