"""Commands of images: their export, and scores of readers."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from ...cli.options import OF_RESULTS, AllowCode, DataFolder, Designs, Jobs, RunFolder
from ...cli.output import Json, ProgressDisplay, Quiet, print_answer

PANEL = OF_RESULTS


class ImageSplit(StrEnum):
    """Splits of exported images."""

    TRAIN = "train"
    CHECK = "check"
    TEST = "test"


class ImageFormat(StrEnum):
    """Formats of exported images."""

    ARRAYS = "arrays"
    COCO = "coco"
    YOLO = "yolo"


class ImageForm(StrEnum):
    """Forms of exported images."""

    RAW = "raw"
    DEMOSAICKED = "demosaicked"
    ISP = "isp"


def export_images(
    folder: RunFolder,
    images: Annotated[Path, typer.Argument(help="Folder for the images, with labels.", show_default=False)],
    design: Designs = None,
    form: Annotated[
        ImageForm, typer.Option(help="Raw mosaics, all channels at all pixels, or pictures of a plain ISP.")
    ] = ImageForm.RAW,
    format_: Annotated[
        ImageFormat, typer.Option("--format", help="Arrays (.npz), or PNGs of streets with boxes of COCO or YOLO.")
    ] = ImageFormat.ARRAYS,
    split: Annotated[
        list[ImageSplit] | None, typer.Option(help="Images of this split; may be repeated.", show_default="all")
    ] = None,
    jobs: Jobs = None,
    data: DataFolder = None,
    allow_code: AllowCode = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Write the images of a finished run of a study with `vision`, with labels."""
    from .export_images import export_images as exported

    with ProgressDisplay(quiet=quiet) as display:
        answer = exported(
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


def score(
    folder: RunFolder,
    predictions: Annotated[
        list[Path],
        typer.Argument(
            help="CSV or Parquet: image_id, and state or a probability of each; or detections in streets: "
            "results of COCO (.json), or a folder of them.",
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
    from .score_report import score as scored

    print_answer(scored(folder, predictions, output=output), as_json=as_json, quiet=quiet)
