"""Images of a finished benchmark as files."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from ...base.answer import Answer
from ...base.errors import SweepError, ValidationIssue, nearest
from ...base.types import Progress, silent
from ...results.designs import study_of
from ...results.folder import run_folder
from ...results.manifest import Manifest
from ...results.output import read_output
from ...runs.workers import workers
from .batches import FORMS, Form
from .image_files import FORMATS, MANIFEST, STREET_MANIFEST, Format, ImageFiles, dataset_of, write_images
from .lamps import SPLITS
from .score import vision_of
from .street import street_shape
from .tables import vision_designs


def export_images(
    folder: Path | str,
    images: Path | str,
    *,
    format: Format = "arrays",  # noqa: A002  (as the option of the command)
    form: Form = "raw",
    split: Sequence[str] = (),
    design: Sequence[str] = (),
    data: Path | str | None = None,
    jobs: int | None = None,
    progress: Progress = silent,
    allow_code: bool = False,
) -> Answer:
    """Write the images of a run's benchmark of vision with labels, and say what they are.

    Parameters
    ----------
    folder : path-like
        Folder of a finished run of a study with `vision`.
    images : path-like
        Folder of the images: a new or empty one, or that of an export that was interrupted.
    format : {'arrays', 'coco', 'yolo'}
        Arrays of heads and of streets, or a PNG for each street with boxes around heads and lit lenses.
    form : {'raw', 'demosaicked', 'isp'}
        Raw mosaics, every channel at every pixel, or pictures of a plain ISP.
    split : sequence of {'train', 'check', 'test'}
        Splits; all where it is empty.
    design : sequence of str
        Names of designs; all where it is empty.
    data : path-like, optional
        Folder of the study's files; left out, the curves that the run kept are taken.
    jobs : int, optional
        Worker processes; left out, one for each core.
    progress : callable
        Told how far it is.
    allow_code : bool
        Permit the code that the study names to run.

    Returns
    -------
    Answer
        Numbers of images, their size, and the files.

    Raises
    ------
    SweepError
        If the study has no images, no such design, split, format or form, boxes are asked for without streets or of a
        form of no PNG, or the folder holds other files.
    """
    folder = run_folder(folder)
    for key, value, known in (
        ("format", format, FORMATS),
        ("form", form, FORMS),
        *(("split", s, SPLITS) for s in split),
    ):
        if value not in known:
            raise SweepError(
                ValidationIssue(
                    "unknown", key=key, value=value, allowed=", ".join(known), nearest=nearest(value, known)
                )
            )
    files = ImageFiles(Path(images), format, form, tuple(name for name in SPLITS if not split or name in split))
    output = read_output(folder)
    vision = vision_of(output)
    if files.format != "arrays":
        key = "--format"
        if vision.street is None:
            raise SweepError(ValidationIssue("boxes are of streets", key=key, allowed="a study with `vision.street`"))
        if files.form == "demosaicked":
            problem, allowed = "PNGs of more than three channels", "--form raw or isp, or --format arrays"
            raise SweepError(ValidationIssue(problem, key=key, allowed=allowed))
        if files.form == "raw" and output.study.pixel.captures:
            problem = "merged values of an HDR pixel are no whole numbers of 16 bits"
            raise SweepError(ValidationIssue(problem, key=key, allowed="--form isp, or --format arrays"))
    study = study_of(output, None if data is None else Path(data), allow_code=allow_code)
    made = vision_designs(study, output.named_rows)
    names = [str(row["name"]) for row, *_ in made]
    for name in design:
        if name not in names:
            allowed, near = ", ".join(names), nearest(name, names)
            raise SweepError(ValidationIssue("unknown", key="--design", value=name, allowed=allowed, nearest=near))
    chosen = [one for one in made if not design or one[0]["name"] in design]
    with workers(jobs or os.cpu_count() or 1) as parallel:
        fingerprint = Manifest(folder).fingerprint
        counts = write_images(chosen, vision, study.section.seed, fingerprint, files, parallel, progress)
    names = [str(row["name"]) for row, *_ in chosen]
    told = ", ".join(f"{count:,} to {split}" for split, count in counts.items())
    all_of = f"{sum(counts.values()):,} images of {', '.join(names)}: {told}"
    lines = [f"{all_of}; the same scenes, lamps and photons for every design."]
    if vision.street is not None:
        rows, columns = street_shape(vision, chosen[0][1].camera.mosaic.indices.shape)
        lines.append(f"Streets are a crop of {columns} x {rows} pixels of the sensor.")
    if files.format == "arrays":
        street = f"{STREET_MANIFEST} (streets), " if vision.street else ""
        lines.append(f"Files: {files.folder}/: {MANIFEST}, {street}images/.")
    else:
        more = "data.yaml, labels/" if files.format == "yolo" else "annotations/"
        datasets = ", ".join(f"{dataset_of(row)}/" for row, *_ in chosen)
        lines.append(f"Files: {files.folder}/: {datasets} each with images/, {more}; {STREET_MANIFEST}.")
    facts = {"folder": str(files.folder), "images": sum(counts.values()), "designs": names}
    return Answer(lines, facts)
