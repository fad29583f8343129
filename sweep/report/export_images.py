"""Images of a finished benchmark as files."""

from __future__ import annotations

import os
from pathlib import Path

from ..base.answer import Answer
from ..base.errors import SweepError, ValidationIssue
from ..base.types import Progress
from ..results.designs import study_of
from ..results.manifest import Manifest
from ..results.output import read_output
from ..runs.image_files import MANIFEST, STREET_MANIFEST, ImageFiles, write_images
from ..runs.score import vision_of
from ..runs.vision import vision_designs
from ..runs.workers import workers


def export_images(
    folder: Path,
    files: ImageFiles,
    data: Path | None,
    jobs: int | None,
    progress: Progress,
    *,
    allow_code: bool = False,
) -> Answer:
    """Write the images of a run's benchmark with labels, and say what they are.

    `data`: folder of the study's files; without it, the curves that the run kept are taken; `allow_code`: True to run
    the code that the study names. Raises SweepError if the study has no `vision`, or the form is no PNG, of which
    COCO's boxes are. Raises OutputError as `read_output` and `write_images`.
    """
    output = read_output(folder)
    vision = vision_of(output)
    if files.coco and not files.png:
        raise SweepError(ValidationIssue("boxes are of one file for each image", key="--coco", allowed="with --png"))
    if files.png and files.form == "demosaicked":
        raise SweepError(ValidationIssue("of more than three channels", key="--png", allowed="--form raw or isp"))
    if files.png and files.form == "raw" and output.study.pixel.captures:
        problem = "merged values of an HDR pixel are no whole numbers of 16 bits"
        raise SweepError(ValidationIssue(problem, key="--png", allowed="--form isp, or without --png"))
    study = study_of(output, data, allow_code=allow_code)
    designs = vision_designs(study, output.named_rows)
    with workers(jobs or os.cpu_count() or 1) as parallel:
        fingerprint = Manifest(folder).fingerprint
        manifest = write_images(designs, vision, study.section.seed, fingerprint, files, parallel, progress)
    names = ", ".join(str(row["name"]) for row, *_ in designs)
    splits = manifest["split"].value_counts().to_pylist()
    counts = ", ".join(f"{part['counts']:,} to {part['values']}" for part in splits)
    street = f"{STREET_MANIFEST} (streets), " if vision.street else ""
    boxes = ", coco-*.json" if files.coco else ""
    lines = [
        f"{len(manifest):,} images of {names}: {counts}; the same scenes, lamps and photons for every design.",
        f"Files: {files.folder}/: {MANIFEST}, {street}images/{boxes}.",
    ]
    return Answer(lines, {"folder": str(files.folder), "images": len(manifest), "designs": names.split(", ")})
