"""Images of a benchmark of vision as files, with labels: for detectors of other people.

Scenes, lamps and photons are those of the run: an image of the test is the one that the ideal observer and the network
have read, and its `image_id` names it in a file of predictions.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from ..base.errors import OutputError, ValidationIssue
from ..base.types import ChannelCurves, Parallel, Progress, delayed
from ..camera.setup import Setup
from ..results.atomic import atomic, write_text
from ..study import Study
from ..vision.batches import Batch, Form, images_of_split
from ..vision.images import HeadCamera
from ..vision.lamps import SPLITS, TEST, TRAIN, split_lamps
from ..vision.section import Vision
from ..vision.street import StreetCamera, draw_streets
from .coco import coco
from .vision import vision_designs
from .workers import run_with_progress

MANIFEST, STREET_MANIFEST = "manifest.parquet", "street.parquet"
_SETTINGS, _PARTS_FOLDER = "images.json", "parts"
_TEXT, _NUMBER, _COUNT = pa.string(), pa.float64(), pa.int64()
_KINDS: dict[pa.DataType, str] = {
    _TEXT: "image_id file name cfa order split state lamp background level",
    _COUNT: "index design_id seed image lit",
    _NUMBER: "intensity_cd distance_m exposure_s lens_diameter_px",
    pa.bool_(): "phantom",
    pa.list_(_TEXT): "lenses",
    pa.list_(_NUMBER): "lens_x_px lens_y_px",
}
_SCHEMA = pa.schema([(name, kind) for kind, names in _KINDS.items() for name in names.split()])
_STREET_KINDS: dict[pa.DataType, str] = {
    _TEXT: "image_id file name cfa order split background level",
    _COUNT: "index design_id seed image",
    pa.bool_(): "phantom",
    pa.list_(_TEXT): "state",
    pa.list_(
        _NUMBER
    ): "intensity_cd distance_m lens_diameter_px head_x_px head_y_px lit_y_px head_width_px head_height_px",
}
_STREET_SCHEMA = pa.schema([(name, kind) for kind, names in _STREET_KINDS.items() for name in names.split()])


@dataclass(frozen=True)
class ImageFiles:
    """Folder and form of exported images.

    `png`: a PNG for each image instead of arrays of 1,024; `coco`: True for boxes of COCO, too, for the PNGs of each
    design and split.
    """

    folder: Path
    form: Form
    png: bool
    splits: tuple[str, ...] = SPLITS
    coco: bool = False


def write_images(
    designs: list[tuple[dict[str, Any], Setup, ChannelCurves]],
    vision: Vision,
    seed: int,
    fingerprint: str,
    files: ImageFiles,
    parallel: Parallel,
    progress: Progress,
) -> pa.Table:
    """Write the images of every design, seed, order and split, and their manifest.

    Deterministic; what an interrupted export has finished, a design with a seed each, is kept and not repeated.

    Returns manifest, a row per image. Raises OutputError if the folder holds other images, or the disk refuses.
    """
    settings = {"fingerprint": fingerprint, "form": files.form, "png": files.png, "splits": list(files.splits)}
    known = files.folder / _SETTINGS
    if known.exists():
        if json.loads(known.read_text(encoding="utf-8")) != settings:
            raise OutputError(ValidationIssue("holds other images", str(files.folder), allowed="another folder"))
    elif files.folder.exists() and any(files.folder.iterdir()):
        raise OutputError(ValidationIssue("holds other files", str(files.folder), allowed="a new or empty folder"))
    write_text(json.dumps(settings), known)
    parts, calls = [], []
    for row, setup, curves in designs:
        for number in range(vision.seeds):
            parts.append(files.folder / _PARTS_FOLDER / f"{row['design_id']}-{number}.parquet")
            if not parts[-1].exists():
                calls.append(delayed(_write_part, row, setup, curves, vision, (seed, number), files, parts[-1]))
    for _ in run_with_progress(parallel, calls, "images written (designs x seeds)", progress):
        pass
    manifest = _joined(parts, files.folder / MANIFEST)
    manifests = [("coco", manifest)]
    if vision.street is not None:
        manifests.append(
            ("coco-street", _joined([_of_streets(part) for part in parts], files.folder / STREET_MANIFEST))
        )
    if files.coco:
        tiles = {int(row["design_id"]): setup.camera.mosaic.indices.shape for row, setup, _ in designs}
        for stem, table in manifests:
            for (design_id, split), part in table.to_pandas().groupby(["design_id", "split"]):
                boxes = json.dumps(coco(part, vision, tiles[int(design_id)]))
                write_text(boxes, files.folder / f"{stem}-{design_id}-{split}.json")
    return manifest


def _joined(parts: Sequence[Path], to: Path) -> pa.Table:
    manifest = pa.concat_tables([pq.read_table(part) for part in parts])
    with atomic(to) as hidden:
        pq.write_table(manifest, hidden)
    return manifest


def _of_streets(part: Path) -> Path:
    return part.with_name(f"{part.stem}-street.parquet")


def images_of_run(study: Study, rows: pd.DataFrame, split: str, names: Sequence[str], form: Form) -> Iterator[Batch]:
    """Yield the images of a run's benchmark, without files, design by design and seed by seed."""
    vision = study.section.vision
    assert vision is not None
    for row, setup, curves in vision_designs(study, rows):
        if row["name"] in names:
            camera = HeadCamera(setup, curves, vision)
            for number in range(vision.seeds):
                lamps = split_lamps(setup.lights, vision, (study.section.seed, number))
                yield from images_of_split(camera, lamps, _key(row, number), study.section.seed, split, form)


def _key(row: Mapping[str, Any], seed: int) -> dict[str, Any]:
    return {name: row[name] for name in ("design_id", "name", "cfa")} | {"seed": seed}


def _write_part(
    row: Mapping[str, Any],
    setup: Setup,
    curves: ChannelCurves,
    vision: Vision,
    seed: tuple[int, int],
    files: ImageFiles,
    part: Path,
) -> int:
    """Write the images of one design and seed, then their part of the manifest."""
    camera, lamps = HeadCamera(setup, curves, vision), split_lamps(setup.lights, vision, seed)
    key = _key(row, seed[1])
    if vision.street is not None:
        streets = StreetCamera(camera, vision.street)
        drawn = {split: draw_streets(vision, vision.street, split, seed) for split in (TRAIN, TEST)}
        batches = (
            streets.batches(drawn[split], lamps[split], key, split, files.form)
            for split in files.splits
            if split in drawn
        )
        _write_batches(chain.from_iterable(batches), files, _STREET_SCHEMA, _of_streets(part))
    batches = (images_of_split(camera, lamps, key, seed[0], split, files.form) for split in files.splits)
    return _write_batches(chain.from_iterable(batches), files, _SCHEMA, part)


def _write_batches(batches: Iterable[Batch], files: ImageFiles, schema: pa.Schema, part: Path) -> int:
    """Write images, then their part of the manifest."""
    tables = [
        pa.Table.from_pandas(_write_block(batch, files), schema=schema, preserve_index=False) for batch in batches
    ]
    with atomic(part) as hidden:
        pq.write_table(pa.concat_tables([schema.empty_table(), *tables]), hidden)
    return sum(map(len, tables))


def _write_block(batch: Batch, files: ImageFiles) -> pd.DataFrame:
    """Write some images, and return their rows of the manifest."""
    images, labels = batch
    first = labels.iloc[0]
    stem = f"images/{first['design_id']}/{first['seed']}-{first['order']}-{first['split']}"
    if files.png:
        names = [f"{stem}-{number}.png" for number in labels["image"]]
        for image, name in zip(images, names, strict=True):
            _write_png(image, files.folder / name)
        return labels.assign(file=names, index=0)
    name = f"{stem}-{first['image']}.npz"
    with atomic(files.folder / name) as hidden, hidden.open("wb") as file:
        np.savez_compressed(file, images=images)
    return labels.assign(file=name, index=np.arange(len(labels)))


def _write_png(image: NDArray[np.uint8] | NDArray[np.uint16], path: Path) -> None:
    from PIL import Image  # noqa: PLC0415  (slow to import)

    with atomic(path) as hidden, hidden.open("wb") as file:
        Image.fromarray(image).save(file, "PNG")
