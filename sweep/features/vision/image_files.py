"""Images of a benchmark of vision as files, with labels: for detectors of other people.

Scenes, lamps and photons are those of the run: an image of the test is the one that the ideal observer and the readers
have read, and its `image_id` names it in a file of predictions.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, get_args

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from ...base.cache import Cache
from ...base.disk import digest_of
from ...base.errors import OutputError, SweepError, ValidationIssue, nearest
from ...base.types import ChannelCurves, Parallel, Progress, delayed
from ...camera.setup import Setup
from ...results.atomic import atomic, write_text
from ...results.folder import begin, run_in
from ...results.lock import locked
from ...results.manifest import Manifest
from ...results.tables import read_table
from ...runs.workers import run_with_progress, stopped_by_signals
from ...study import Study
from .batches import FORMS, TOGETHER, Batch, Form, batches, images_of_split, scenes_of
from .boxed import data_yaml, write_coco, yolo_lines
from .images import HeadCamera
from .isp import isp_of
from .keys import Vision
from .lamps import SPLITS, TEST, split_lamps
from .scenes import ORDERS, SHUFFLED
from .street import STREET, StreetCamera, count_of, draw_streets, street_shape
from .tables import vision_designs

if TYPE_CHECKING:
    from ...api.objects import FinishedRun

Format = Literal["arrays", "coco", "yolo"]
"""Arrays of heads and streets, or a PNG for each street with boxes."""
FORMATS = get_args(Format)
MANIFEST, STREET_MANIFEST = "manifest.parquet", "street.parquet"
_PARTS_FOLDER = "parts"
_BLOCK_PIXELS = 2**25
"""Pixels of streets that are repeated if an export is killed."""
_COMPRESSION = 1
_TEXT, _NUMBER, _COUNT = pa.string(), pa.float64(), pa.int64()
_KINDS: dict[pa.DataType, str] = {
    _TEXT: "image_id file name cfa order split state lamp background level",
    _COUNT: "index design_id seed image lit",
    _NUMBER: "intensity_cd distance_m exposure_s lens_diameter_px",
    pa.bool_(): "phantom",
    pa.list_(_TEXT): "lenses",
    pa.list_(_NUMBER): "lens_x_px lens_y_px",
}
_STREET_KINDS: dict[pa.DataType, str] = {
    _TEXT: "image_id file name cfa order split background level",
    _COUNT: "index design_id seed image coco_id",
    pa.bool_(): "phantom",
    pa.list_(_TEXT): "state",
    pa.list_(
        _NUMBER
    ): "intensity_cd distance_m lens_diameter_px head_x_px head_y_px lit_y_px head_width_px head_height_px",
}


def _schema(kinds: Mapping[pa.DataType, str]) -> pa.Schema:
    return pa.schema([(name, kind) for kind, names in kinds.items() for name in names.split()])


_SCHEMA, _STREET_SCHEMA = _schema(_KINDS), _schema(_STREET_KINDS)


@dataclass(frozen=True)
class ImageFiles:
    """Folder, format and form of exported images."""

    folder: Path
    format: Format
    form: Form
    splits: tuple[str, ...] = SPLITS


class _Block(NamedTuple):
    """Some images of one design, seed, order (or streets) and split."""

    row: Mapping[str, Any]
    seed: int
    order: str
    split: str
    start: int
    stop: int

    def part(self, folder: Path) -> Path:
        """Return its part of the manifest, which is written when its images are."""
        name = f"{self.row['design_id']}-{self.seed}-{self.order}-{self.split}-{self.start}.parquet"
        return folder / _PARTS_FOLDER / name


def dataset_of(row: Mapping[str, Any]) -> str:
    """Return the folder of a design's PNGs."""
    return f"{row['design_id']}-{re.sub(r'[^A-Za-z0-9]+', '-', str(row['name'])).strip('-')}"


def write_images(
    designs: list[tuple[dict[str, Any], Setup, ChannelCurves]],
    vision: Vision,
    seed: int,
    fingerprint: str,
    files: ImageFiles,
    parallel: Parallel,
    progress: Progress,
) -> dict[str, int]:
    """Write the images of every design, seed, order and split, and their manifests.

    Deterministic; blocks of an earlier export whose files are as it wrote them are kept and not repeated.

    Returns the number of images of each split, streets among them. Raises OutputError if the folder is in use, holds
    other images, or the disk refuses.
    """
    settings: dict[str, Any] = {"run": fingerprint, "format": files.format, "form": files.form}
    settings |= {"splits": [*files.splits], "designs": [str(row["name"]) for row, *_ in designs]}
    facts = {"fingerprint": hashlib.sha256(json.dumps(settings).encode()).hexdigest(), "identity": settings}
    if files.folder.exists() and not files.folder.is_dir():
        raise OutputError(ValidationIssue("is no folder", str(files.folder), allowed="a new or empty folder"))
    held = run_in(files.folder)
    if held is None and files.folder.exists() and any(files.folder.iterdir()):
        raise OutputError(ValidationIssue("holds other files", str(files.folder), allowed="a new or empty folder"))
    if held is not None and not held.is_of(facts):
        raise OutputError(ValidationIssue("holds other images", str(files.folder), allowed="another folder"))
    with stopped_by_signals(), locked(files.folder):
        known = begin(files.folder, facts)
        return _write_blocks(known, designs, vision, seed, fingerprint, files, parallel, progress)


def _write_blocks(
    known: Manifest,
    designs: list[tuple[dict[str, Any], Setup, ChannelCurves]],
    vision: Vision,
    seed: int,
    fingerprint: str,
    files: ImageFiles,
    parallel: Parallel,
    progress: Progress,
) -> dict[str, int]:
    calls, blocks = [], list[_Block]()
    for left in files.folder.rglob(".tmp-*~"):
        left.unlink(missing_ok=True)  # of a killed export
    for row, setup, curves in designs:
        for block in _blocks(row, setup, vision, files):
            blocks.append(block)
            if not _is_whole(known, block.part(files.folder)):
                calls.append(delayed(_write_block, block, setup, curves, vision, seed, files, fingerprint))
    for written in run_with_progress(parallel, calls, "images written (blocks)", progress):
        known.add(written)
    streets = [block for block in blocks if block.order == STREET]
    heads = [block for block in blocks if block.order != STREET]
    for some, schema, name in ((heads, _SCHEMA, MANIFEST), (streets, _STREET_SCHEMA, STREET_MANIFEST)):
        if some:
            _join([block.part(files.folder) for block in some], schema, files.folder / name)
    if files.format != "arrays":
        for row, setup, curves in designs:
            _describe(row, setup, curves, vision, files, [block for block in streets if block.row == row])
    return {split: sum(b.stop - b.start for b in blocks if b.split == split) for split in files.splits}


def _blocks(row: Mapping[str, Any], setup: Setup, vision: Vision, files: ImageFiles) -> Iterator[_Block]:
    """Yield what is written at once: of streets as many as the memory and the time of a killed one allow."""
    for seed in range(vision.seeds):
        for split in files.splits:
            if vision.street is not None:
                high, wide = street_shape(vision, setup.camera.mosaic.indices.shape)
                step, most = max(1, min(TOGETHER, _BLOCK_PIXELS // (high * wide))), count_of(vision.street, split)
                for start in range(0, most, step):
                    yield _Block(row, seed, STREET, split, start, min(start + step, most))
            if files.format == "arrays":
                most = vision.images_of(split)
                for order in ORDERS if split == TEST else (SHUFFLED,):
                    for start in range(0, most, TOGETHER):
                        yield _Block(row, seed, order, split, start, min(start + TOGETHER, most))


def _is_whole(known: Manifest, part: Path) -> bool:
    """Return whether a block's part of the manifest and the files that it names are as they were written."""
    name = part.relative_to(known.folder).as_posix()
    if known.wrong([name]):
        return False
    named = set(read_table(part, ["file"])["file"].to_pylist())
    return not known.wrong([*named, *filter(known.files.__contains__, map(_labels_of, named))])


def _labels_of(picture: str) -> str:
    """Return the text of YOLO that belongs to a picture."""
    return picture.replace("/images/", "/labels/").removesuffix(".png") + ".txt"


def _join(parts: Sequence[Path], schema: pa.Schema, to: Path) -> None:
    """Write one manifest, part by part."""
    with atomic(to) as hidden, pq.ParquetWriter(hidden, schema) as writer:
        for part in parts:
            writer.write_table(pq.read_table(part, schema=schema))


def _describe(
    row: Mapping[str, Any], setup: Setup, curves: ChannelCurves, vision: Vision, files: ImageFiles, own: list[_Block]
) -> None:
    """Write what tells a detector of the PNGs of a design: boxes of COCO or `data.yaml`, and the ISP's constants."""
    folder = files.folder / dataset_of(row)
    shape = street_shape(vision, setup.camera.mosaic.indices.shape)
    if files.format == "yolo":
        write_text(data_yaml(files.splits, vision), folder / "data.yaml")
    else:
        for split in files.splits:
            parts = [block.part(files.folder) for block in own if block.split == split]
            write_coco(parts, vision, shape, folder / "annotations" / f"instances_{split}.json")
    if files.form == "isp":
        qe = HeadCamera(setup, curves, vision).qe
        lights = {level.light for level in vision.levels.values()}
        isps = {light: isp_of(setup.camera.grid, qe, light) for light in sorted(lights)}
        channels = list(setup.camera.mosaic.channels)
        held = {light: {"white": isp.white.tolist(), "matrix": isp.matrix.tolist()} for light, isp in isps.items()}
        write_text(json.dumps({"channels": channels, "gamma": "sRGB", "lights": held}, indent=1), folder / "isp.json")


def images_of_run(study: Study, rows: pd.DataFrame, split: str, names: Sequence[str], form: Form) -> Iterator[Batch]:
    """Yield the images of a run's benchmark, without files, design by design and seed by seed."""
    vision: Vision = study.section.key("vision")
    for row, setup, curves in vision_designs(study, rows):
        if row["name"] in names:
            camera = HeadCamera(setup, curves, vision)
            for number in range(vision.seeds):
                lamps = split_lamps(setup.lights, vision, (study.section.seed, number))
                yield from images_of_split(camera, lamps, _key(row, number), study.section.seed, split, form)


def _key(row: Mapping[str, Any], seed: int) -> dict[str, Any]:
    return {name: row[name] for name in ("design_id", "name", "cfa")} | {"seed": seed}


_cameras: Cache[tuple[Any, ...], HeadCamera] = Cache(1)


def _write_block(
    block: _Block,
    setup: Setup,
    curves: ChannelCurves,
    vision: Vision,
    seed: int,
    files: ImageFiles,
    fingerprint: str,
) -> dict[str, str]:
    """Write some images, then their part of the manifest; returns the digests of the files by name."""
    camera = _cameras.get((fingerprint, block.row["design_id"]), lambda: HeadCamera(setup, curves, vision))
    key, where = _key(block.row, block.seed), (seed, block.seed)
    lamps, some = split_lamps(setup.lights, vision, where), slice(block.start, block.stop)
    if block.order != STREET:
        scenes = scenes_of(vision, lamps, block.order, block.split, where)
        made, schema = batches(camera, scenes, key, block.order, block.split, files.form, some), _SCHEMA
    else:
        assert vision.street is not None
        streets = draw_streets(vision, vision.street, block.split, where)
        own = StreetCamera(camera, vision.street)
        made, schema = own.batches(streets, lamps[block.split], key, block.split, files.form, some), _STREET_SCHEMA
    arrays = files.format == "arrays"
    written = _write_arrays(made, block, files) if arrays else _write_pictures(made, block, vision, files)
    tables = [pa.Table.from_pandas(t, schema=schema, preserve_index=False) for t in written]
    table, part = pa.concat_tables(tables), block.part(files.folder)
    with atomic(part) as hidden:
        pq.write_table(table, hidden)
    named = [files.folder / name for name in set(table["file"].to_pylist())]
    labels = [files.folder / _labels_of(name) for name in table["file"].to_pylist()] if files.format == "yolo" else []
    return {path.relative_to(files.folder).as_posix(): digest_of(path) for path in (part, *named, *labels)}


def _write_arrays(made: Iterable[Batch], block: _Block, files: ImageFiles) -> Iterator[pd.DataFrame]:
    """Write an array of images, and yield their rows of the manifest."""
    stem = f"images/{block.row['design_id']}/{block.seed}-{block.order}-{block.split}"
    for images, labels in made:
        name = f"{stem}-{labels['image'].iloc[0]}.npz"
        with atomic(files.folder / name) as hidden, hidden.open("wb") as file:
            np.savez_compressed(file, images=images)
        yield labels.assign(file=name, index=np.arange(len(labels)))


def _write_pictures(made: Iterable[Batch], block: _Block, vision: Vision, files: ImageFiles) -> Iterator[pd.DataFrame]:
    """Write a PNG of each street, for YOLO beside its boxes, and yield their rows of the manifest."""
    folder = dataset_of(block.row)
    for images, labels in made:
        names = [f"{folder}/images/{block.split}/{name}.png" for name in labels["image_id"]]
        for image, name in zip(images, names, strict=True):
            _write_png(image, files.folder / name)
        if files.format == "yolo":
            for name, text in yolo_lines(labels, vision, images.shape[1:3]):
                write_text(text, files.folder / folder / "labels" / block.split / f"{name}.txt")
        yield labels.assign(file=names, index=0)


def _write_png(image: NDArray[np.uint8] | NDArray[np.uint16], path: Path) -> None:
    from PIL import Image  # noqa: PLC0415  (slow to import)

    with atomic(path) as hidden, hidden.open("wb") as file:
        Image.fromarray(image).save(file, "PNG", compress_level=_COMPRESSION)


def images(
    run: FinishedRun, split: str = "test", designs: Sequence[str] | None = None, form: Form = "raw"
) -> Iterator[Batch]:
    """Yield labeled images of the run's benchmark of vision, up to 1,024 at once, without files.

    Parameters
    ----------
    run : FinishedRun
        Run of a study with `vision`.
    split : {'train', 'check', 'test'}
        Split. The readers of the run have read those of the test.
    designs : sequence of str, optional
        Names of designs, such as "RGGB"; all of them by default.
    form : {'raw', 'demosaicked', 'isp'}
        Raw mosaics (uint16 DN, float32 of HDR pixels), every channel at every pixel (float32 DN above the black
        level), or pictures of a plain ISP (uint8 sRGB).

    Yields
    ------
    Batch
        `images`, ndarray of shape (n, rows, columns) or (n, rows, columns, n_channels), and `labels`, a table with
        the columns of an exported manifest.

    Raises
    ------
    SweepError
        If the run has no images, or no such design, split or form.
    """
    from .score import unseen_images  # noqa: PLC0415  (it imports this)

    names = list(unseen_images(run.output)["name"].unique())
    chosen = names if designs is None else list(designs)
    for value, known in ((split, SPLITS), (form, FORMS), *((name, names) for name in chosen)):
        if value not in known:
            allowed, near = ", ".join(known), nearest(value, known)
            raise SweepError(ValidationIssue("unknown", value=value, allowed=allowed, nearest=near))
    return images_of_run(run.study.study, run.output.named_rows, split, chosen, form)
