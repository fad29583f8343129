"""Images of a finished benchmark as files."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from ..base.answer import Answer
from ..base.errors import SweepError, ValidationIssue, nearest
from ..base.types import Progress
from ..results.designs import study_of
from ..results.manifest import Manifest
from ..results.output import read_output
from ..runs.image_files import MANIFEST, STREET_MANIFEST, ImageFiles, dataset_of, write_images
from ..runs.score import vision_of
from ..runs.vision import vision_designs
from ..runs.workers import workers
from ..vision.street import street_shape


def export_images(
    folder: Path,
    files: ImageFiles,
    designs: Sequence[str],
    data: Path | None,
    jobs: int | None,
    progress: Progress,
    *,
    allow_code: bool = False,
) -> Answer:
    """Write the images of a run's benchmark with labels, and say what they are.

    `designs`: names; all where it is empty; `data`: folder of the study's files; without it, the curves that the run
    kept are taken; `allow_code`: True to run the code that the study names. Raises SweepError if the study has no
    `vision`, or no streets or a form of no PNG, of which boxes are. Raises OutputError as `read_output` and
    `write_images`.
    """
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
    study = study_of(output, data, allow_code=allow_code)
    known = vision_designs(study, output.named_rows)
    names = [str(row["name"]) for row, *_ in known]
    for name in designs:
        if name not in names:
            allowed, near = ", ".join(names), nearest(name, names)
            raise SweepError(ValidationIssue("unknown", key="--design", value=name, allowed=allowed, nearest=near))
    chosen = [one for one in known if not designs or one[0]["name"] in designs]
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
