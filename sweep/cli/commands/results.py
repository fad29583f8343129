"""Commands of the results of runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...base.errors import SweepError, ValidationIssue
from ..options import (
    OF_RESULTS,
    AllowCode,
    DataFolder,
    Designs,
    Force,
    ImageForm,
    ImageFormat,
    ImageSplit,
    Jobs,
    RunFolder,
    run_folders,
)
from ..output import Json, ProgressDisplay, Quiet, print_answer

PANEL = OF_RESULTS


def audit(
    folder: RunFolder,
    data: DataFolder = None,
    allow_code: AllowCode = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Compute the front and 1 % of a run's rows again at the reference settings, and compare.

    Exit code 5 says that an error is larger than the study's tolerance allows.
    """
    from ...runs.audit import audit as audited

    with ProgressDisplay(quiet=quiet) as display:
        answer = audited(folder, data, allow_code=allow_code, progress=display.update)
    print_answer(answer, as_json=as_json, quiet=quiet)


def compare(
    folders: Annotated[
        list[Path],
        typer.Argument(help="Output folders of two or more studies.", show_default=False, autocompletion=run_folders),
    ],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Folder for the comparison.", show_default="outputs/compare-A-B"),
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Compare finished runs: studies, best designs, fronts, versions."""
    from ...report.compare import compare as compared

    print_answer(compared(folders, output=output), as_json=as_json, quiet=quiet)


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
        from ...api.export import export as exported

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


def open_(folder: RunFolder, as_json: Json = False, quiet: Quiet = False) -> None:
    """Open the report of a finished run in the browser."""
    from ...api.run import show

    print_answer(show(folder), as_json=as_json, quiet=quiet)


def score(
    folder: RunFolder,
    predictions: Annotated[
        list[Path],
        typer.Argument(
            help="CSV or Parquet: image_id, and state or a probability of each; or COCO results (.json), a folder of "
            "YOLO's text files, or a table of points: detections in streets.",
            show_default=False,
        ),
    ],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Folder of the scores.", show_default="FOLDER/scores")
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Score readers of a benchmark's test images: errors of each CFA, differences, distance from the ideal observer."""
    from ...report.scores import score as scored

    print_answer(scored(folder, predictions, output=output), as_json=as_json, quiet=quiet)


def report(context: typer.Context, folder: RunFolder, as_json: Json = False, quiet: Quiet = False) -> None:
    """Draw figures and report of a finished run again."""
    from ...api.run import report as drawn

    print_answer(drawn(folder, began_s=context.find_root().obj), as_json=as_json, quiet=quiet)


def status(
    folder: RunFolder,
    verify: Annotated[bool, typer.Option("--verify", help="Compare the digests of all its files.")] = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Say how far a run is, from another terminal; of a finished one, which of its files are missing or damaged."""
    from ...runs.status import status as status_of

    print_answer(status_of(folder, verify=verify), as_json=as_json, quiet=quiet)
