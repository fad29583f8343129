"""Command that measures what accuracy costs."""

from __future__ import annotations

from pathlib import Path

from ...cli.options import OF_TOOL, DataFolder, Outputs, StudyPath
from ...cli.output import Json, ProgressDisplay, Quiet, print_answer

PANEL = OF_TOOL


def accuracy(
    study: StudyPath,
    data: DataFolder = None,
    output: Outputs = Path("outputs"),
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Measure what accuracy costs: error and time of each preset, and of steps of the wavelengths, in each scene."""
    from ...study import Study, folder_name, load_study
    from ...study.shipped import study_path
    from .accuracy import measure_accuracy

    path = study_path(study)

    def at_step(step_nm: float | None) -> Study:
        return load_study(path, data, changes={} if step_nm is None else {"wavelengths.step_nm": step_nm})

    with ProgressDisplay(quiet=quiet) as display:
        answer = measure_accuracy(at_step, output / folder_name(at_step(None).name), display.update)
    print_answer(answer, as_json=as_json, quiet=quiet)
