"""Begin a study."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...base.errors import Fault, StudyError
from ...curves.light_unit import LightUnit
from ..panels import OF_STUDIES

PANEL = OF_STUDIES


def new(
    name: Annotated[str, typer.Argument(help="Name of the study and of its file.", show_default=False)],
    qe: Annotated[Path | None, typer.Option(help="A file of QE curves of a sensor.", show_default=False)] = None,
    lights: Annotated[Path | None, typer.Option(help="A file of spectra of lights.", show_default=False)] = None,
    pixel: Annotated[
        Path | None, typer.Option(help="EMVA 1288 results (XML) of the sensor's pixel.", show_default=False)
    ] = None,
    quantity: Annotated[LightUnit, typer.Option(help="What the lights' numbers are.")] = "energy",
    folder: Annotated[Path, typer.Option(help="Folder of the studies.")] = Path("studies"),
    source: Annotated[
        str | None, typer.Option("--from", help="A study, or the name of one, to begin with.", show_default=False)
    ] = None,
    copy: Annotated[
        bool, typer.Option("--copy", help="Copy the files of curves beside the study, so that all can be moved.")
    ] = False,
) -> None:
    """Write a commented study that runs as it is, for the built-in curves or for files of your own."""
    from ...study.shipped import study_path
    from ..new import new_study
    from ..new.begin import copied, curve_files_of, study_from

    if source is not None:
        if qe or lights or pixel:
            raise StudyError(Fault("a study that is copied has its own curves and pixel", key="--from", value=source))
        begun = study_path(Path(source))
        with copied((begun.parent / own, folder / own) for own in (curve_files_of(begun) if copy else ())):
            lines = study_from(name, folder, begun)
    elif copy:
        own_qe, own_lights = (None if file is None else folder / file.name for file in (qe, lights))
        with copied((file, folder / file.name) for file in (qe, lights) if file is not None):
            lines = new_study(name, folder, own_qe, own_lights, quantity, pixel)
    else:
        lines = new_study(name, folder, qe, lights, quantity, pixel)
    for line in lines:
        typer.echo(line)
