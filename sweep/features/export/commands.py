"""Command that writes filters and images of finished runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...base.errors import SweepError, ValidationIssue
from ...cli.options import OF_RESULTS, AllowCode, Designs, Force, ImageForm, ImageFormat, ImageSplit, Jobs, RunFolder
from ...cli.output import Json, ProgressDisplay, Quiet, print_answer

PANEL = OF_RESULTS


def export(
    folder: RunFolder,
    design: Designs = None,
    images: Annotated[
        Path | None,
        typer.Option(help="Folder for the images of a study with `vision`, with labels.", show_default=False),
    ] = None,
    form: Annotated[
        ImageForm,
        typer.Option(help="Images: raw mosaics, all channels at all pixels, or pictures of a plain ISP."),
    ] = ImageForm.RAW,
    format_: Annotated[
        ImageFormat,
        typer.Option("--format", help="Images: arrays (.npz), or PNGs of streets with boxes of COCO or YOLO."),
    ] = ImageFormat.ARRAYS,
    split: Annotated[
        list[ImageSplit] | None, typer.Option(help="Images of this split; may be repeated.", show_default="all")
    ] = None,
    jobs: Jobs = None,
    data: Annotated[
        Path | None, typer.Option(help="Folder with the run's curve files, which are then read again and compared.")
    ] = None,
    specification: Annotated[
        bool, typer.Option("--specification", help="Also what an absorption band of the study's map would have to be.")
    ] = False,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Folder for the files.", show_default="FOLDER/export")
    ] = None,
    allow_code: AllowCode = False,
    force: Force = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Write a filter of a finished run as CSV and as ISETCam color filters (.mat), or the images of a benchmark."""
    if not design and images is None:
        allowed = "--design best, or --images FOLDER (of some designs with --design)"
        raise SweepError(ValidationIssue("one of --design and --images", allowed=allowed))
    if design and images is None:
        from .export import export as exported

        answer = exported(
            folder,
            design,
            data,
            output=output,
            specification=specification,
            allow_code=allow_code,
            force=force,
        )
    else:
        from ...api.export_images import export_images

        assert images is not None
        with ProgressDisplay(quiet=quiet) as display:
            answer = export_images(
                folder,
                images,
                format=format_.value,
                form=form.value,
                split=[name.value for name in split or ()],
                design=design or (),
                data=data,
                jobs=jobs,
                progress=display.update,
                allow_code=allow_code,
            )
    print_answer(answer, as_json=as_json, quiet=quiet)
