"""Commands of the results of runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...base.errors import ErrorBoundExceededError, OutputError, SweepError, ValidationIssue
from ..options import OF_RESULTS, AllowCode, DataFolder, ImageForm, ImageSplit, RunFolder, run_folders
from ..output import Json, ProgressDisplay, Quiet, print_result

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
    from ...results.tables import AUDIT
    from ..audit import audit_output

    with ProgressDisplay(quiet=quiet) as display:
        result = audit_output(folder, data, display.update, allow_code=allow_code)
    facts = {"folder": str(folder), "designs": result.n_designs, "rows": result.rows.to_dict("records")}
    print_result([*result.lines, f"Files: {folder}/: {AUDIT}."], facts, as_json=as_json, quiet=quiet)
    if result.issues:
        raise ErrorBoundExceededError(result.issues)


def compare(
    folders: Annotated[
        list[Path],
        typer.Argument(help="Output folders of two or more studies.", show_default=False, autocompletion=run_folders),
    ],
    output: Annotated[
        Path | None, typer.Option(help="Folder for the comparison.", show_default="outputs/compare-A-B")
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Compare finished runs: studies, best designs, fronts, versions."""
    from ...report.compare import compare_runs

    compared = compare_runs(folders, output)
    tables = {name: table.to_dict("records") for name, table in compared.tables.items()} if as_json else {}
    facts = {"folder": str(compared.folder), **tables, "notes": compared.notes}
    print_result(compared.lines, facts, as_json=as_json, quiet=quiet)


def export(
    folder: RunFolder,
    design: Annotated[
        str | None, typer.Option(help="A design_id, a name (RYN4Cy, RGGB), or best.", show_default=False)
    ] = None,
    images: Annotated[
        Path | None,
        typer.Option(help="Folder for the images of a study with `vision`, with labels.", show_default=False),
    ] = None,
    form: Annotated[
        ImageForm,
        typer.Option(help="Images: raw mosaics, all channels at all pixels, or pictures of a plain ISP."),
    ] = ImageForm.RAW,
    png: Annotated[bool, typer.Option("--png", help="A PNG for each image; without it, arrays (.npz).")] = False,
    split: Annotated[
        list[ImageSplit] | None, typer.Option(help="Images of this split; may be repeated.", show_default="all")
    ] = None,
    coco: Annotated[bool, typer.Option("--coco", help="Boxes in COCO's format beside PNGs.")] = False,
    jobs: Annotated[int | None, typer.Option(min=1, help="Workers for images.", show_default="all cores")] = None,
    data: Annotated[
        Path | None, typer.Option(help="Folder with the run's curve files, which are then read again and compared.")
    ] = None,
    specification: Annotated[
        bool, typer.Option("--specification", help="Also what an absorption band of the study's map would have to be.")
    ] = False,
    to: Annotated[Path | None, typer.Option(help="Folder for the files.", show_default="FOLDER/export")] = None,
    allow_code: AllowCode = False,
    quiet: Quiet = False,
) -> None:
    """Write a filter of a finished run as CSV and as ISETCam color filters (.mat), or the images of a benchmark."""
    if (design is None) == (images is None):
        raise SweepError(ValidationIssue("one of --design and --images", allowed="--design best, or --images FOLDER"))
    if design is not None:
        from ..export import export_design

        lines = export_design(folder, design, data, to, with_specification=specification, allow_code=allow_code)
    else:
        from ...run.image_files import ImageFiles
        from ..export_images import export_images

        assert images is not None
        with ProgressDisplay(quiet=quiet) as display:
            splits = tuple(name.value for name in split or ImageSplit)
            files = ImageFiles(images, form.value, png, splits, coco)
            lines = export_images(folder, files, data, jobs, display.update, allow_code=allow_code)
    for line in [] if quiet else lines:
        typer.echo(line)


def score(
    folder: RunFolder,
    predictions: Annotated[
        list[Path],
        typer.Argument(help="CSV or Parquet: image_id, and state or a probability of each.", show_default=False),
    ],
    output: Annotated[Path | None, typer.Option(help="Folder of the scores.", show_default="FOLDER/scores")] = None,
    quiet: Quiet = False,
) -> None:
    """Score readers of a benchmark's test images: errors of each CFA, differences, distance from the ideal observer."""
    from ...report import read_output
    from ...report.scores import score_readers

    run = read_output(folder)
    if run.study.vision is None:
        raise SweepError(ValidationIssue("the study has no `vision`", str(folder)))
    lines = score_readers(run, predictions, folder / "scores" if output is None else output)
    for line in [] if quiet else lines:
        typer.echo(line)


def report(context: typer.Context, folder: RunFolder) -> None:
    """Draw figures and report of a finished run again."""
    from ...report.sensors import report_sensors, runs_in
    from ...results.lock import locked
    from ...results.manifest import Manifest
    from ..run import finish

    began_s = context.find_root().obj
    if not Manifest(folder).runs:
        finish(folder, began_s)
        return
    with locked(folder):
        runs = runs_in(folder)
        if not runs:
            raise OutputError(ValidationIssue("no finished run here", str(folder), allowed="`sweep run` of its study"))
        for run in runs:
            finish(run.folder, began_s, quiet=True)
        for line in report_sensors(Manifest(folder), runs):
            typer.echo(line)


def status(
    folder: RunFolder,
    verify: Annotated[bool, typer.Option("--verify", help="Compare the digests of all its files.")] = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Say how far a run is, from another terminal; of a finished one, which of its files are missing or damaged."""
    from ..status import status_of

    status = status_of(folder, verify=verify)
    print_result(status.lines, status.facts, as_json=as_json, quiet=quiet)
