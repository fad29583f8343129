"""Images of a benchmark of vision as files, with labels: for detectors of other people.

Scenes, lamps and photons are those of the run: an image of the test is the one that the ideal observer and the network
have read, and its `image_id` names it in a file of predictions.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from ..base.errors import OutputError, ValidationIssue
from ..base.types import FloatArray, Parallel, Progress, delayed
from ..camera.setup import Setup
from ..results.atomic import atomic, write_text
from ..vision.head import head_places_px, heights
from ..vision.images import HeadCamera
from ..vision.isp import developed, isp_matrix
from ..vision.lamps import PARTS, split_lamps
from ..vision.planes import demosaicked
from ..vision.readers import scenes_of
from ..vision.scenes import ORDERS, Scenes, orders_of_lenses, states_of
from ..vision.section import Vision
from .workers import run_with_progress

Form = Literal["raw", "demosaicked", "isp"]
MANIFEST, _SETTINGS, _PARTS_FOLDER = "manifest.parquet", "images.json", "parts"
_TOGETHER = 256
"""Images of a file of arrays, which are held at once."""
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


@dataclass(frozen=True)
class ImageFiles:
    """Folder and form of exported images.

    Parameters
    ----------
    folder : Path
        Folder.
    form : {'raw', 'demosaicked', 'isp'}
        Raw mosaics (uint16 DN, float32 of HDR pixels), every channel at every pixel (float32 DN above the black
        level), or pictures of a plain ISP (uint8 sRGB).
    png : bool
        A PNG for each image instead of arrays of 256.
    """

    folder: Path
    form: Form
    png: bool


def image_id(design_id: int, seed: int, order: str, split: str, image: int) -> str:
    """Return the name of an image in manifests and predictions.

    Parameters
    ----------
    design_id, seed, image : int
        Row of the design, number of the seed, and number of the image in its split.
    order, split : str
        Order of the lenses, and part of the images.

    Returns
    -------
    str
        Name.
    """
    return f"{design_id}-{seed}-{order}-{split}-{image}"


def write_images(
    designs: list[tuple[dict[str, Any], Setup, FloatArray]],
    vision: Vision,
    seed: int,
    fingerprint: str,
    files: ImageFiles,
    parallel: Parallel,
    progress: Progress,
) -> pa.Table:
    """Write the images of every design, seed, order and split, and their manifest.

    Deterministic; what an interrupted export has finished, a design with a seed each, is kept and not repeated.

    Parameters
    ----------
    designs : list of (dict, Setup, ndarray)
        `design_id`, `name` and `cfa`, camera, and QE of the modified channels, of each design.
    vision : Vision
        Benchmark.
    seed : int
        Seed of the study.
    fingerprint : str
        Of the run: a folder holds images of one run in one form.
    files : ImageFiles
        Files.
    parallel : callable
        Runs calls on the cores.
    progress : callable
        Called with a phase, work done and work in total.

    Returns
    -------
    pyarrow.Table
        Manifest, a row per image.

    Raises
    ------
    OutputError
        If the folder holds other images, or the disk refuses.
    """
    settings = {"fingerprint": fingerprint, "form": files.form, "png": files.png}
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
    manifest = pa.concat_tables([pq.read_table(part) for part in parts])
    with atomic(files.folder / MANIFEST) as hidden:
        pq.write_table(manifest, hidden)
    return manifest


def _write_part(
    row: dict[str, Any],
    setup: Setup,
    curves: FloatArray,
    vision: Vision,
    seed: tuple[int, int],
    files: ImageFiles,
    part: Path,
) -> int:
    """Write the images of one design and seed, then their part of the manifest."""
    camera = HeadCamera(setup, curves, vision)
    lamps, labels = split_lamps(setup.lights, vision, seed), list[dict[str, Any]]()
    for order in ORDERS:
        for split in PARTS:
            scenes = scenes_of(vision, lamps, order, split, seed)
            for start in range(0, len(scenes), _TOGETHER):
                block = slice(start, min(start + _TOGETHER, len(scenes)))
                labels += _write_block(row, camera, scenes.some(block), (order, split, start), seed[1], files)
    with atomic(part) as hidden:
        pq.write_table(pa.Table.from_pylist(labels, schema=_SCHEMA), hidden)
    return len(labels)


def _write_block(
    row: dict[str, Any],
    camera: HeadCamera,
    scenes: Scenes,
    which: tuple[str, str, int],
    seed: int,
    files: ImageFiles,
) -> Iterator[dict[str, Any]]:
    """Write some images, and yield their rows of the manifest."""
    order, split, start = which
    images = formed(camera, scenes, files.form)
    stem = f"images/{row['design_id']}/{seed}-{order}-{split}"
    block = f"{stem}-{start}.npz"
    if not files.png:
        with atomic(files.folder / block) as hidden, hidden.open("wb") as file:
            np.savez_compressed(file, images=images)
    for at, label in enumerate(_labels(camera, scenes)):
        number = start + at
        name = f"{stem}-{number}.png" if files.png else block
        if files.png:
            _write_png(images[at], files.folder / name)
        key: dict[str, Any] = {"image_id": image_id(row["design_id"], seed, order, split, number), "file": name}
        key |= {"index": 0 if files.png else at, "seed": seed, "order": order, "split": split, "image": number}
        yield {**key, **{n: row[n] for n in ("design_id", "name", "cfa")}, **label}


def formed(camera: HeadCamera, scenes: Scenes, form: Form) -> np.ndarray[Any, Any]:
    """Return images of scenes in a form.

    Parameters
    ----------
    camera : HeadCamera
        Design.
    scenes : Scenes
        Scenes.
    form : {'raw', 'demosaicked', 'isp'}
        Form, see `ImageFiles`.

    Returns
    -------
    ndarray of shape (n, rows, columns) or (n, rows, columns, n_channels)
        Images.
    """
    values_dn, pixel, mosaic = camera.table.values_dn, camera.pixel, camera.setup.camera.mosaic
    dn = values_dn[camera.images(scenes)]
    if form == "raw":
        return dn.astype(np.float32) if pixel.captures else np.rint(dn).astype(np.uint16)
    above_dn = demosaicked(dn, mosaic) - pixel.offset_dn
    if form == "demosaicked":
        return above_dn.astype(np.float32)
    share = above_dn / (values_dn[-1] - pixel.offset_dn)
    lights = [level.light for level in camera.levels]
    pictures = np.empty((*share.shape[:3], 3), dtype=np.uint8)
    for light in dict.fromkeys(lights):
        here = np.flatnonzero([lights[level] == light for level in scenes.level])
        pictures[here] = developed(share[here], isp_matrix(camera.setup.camera.grid, camera.qe, light))
    return pictures


def _write_png(image: np.ndarray[Any, Any], path: Path) -> None:
    from PIL import Image  # noqa: PLC0415  (slow to import)

    with atomic(path) as hidden, hidden.open("wb") as file:
        Image.fromarray(image).save(file, "PNG")


def _labels(camera: HeadCamera, scenes: Scenes) -> Iterator[dict[str, Any]]:
    """Yield state, geometry and light of each image."""
    vision, setup = camera.vision, camera.setup
    states, levels = states_of(vision), list(vision.levels.items())
    places, orders = head_places_px(vision, setup.camera.mosaic), orders_of_lenses(len(vision.lenses))
    across_px = [vision.target(distance).object_resolution_px for distance in vision.distances_m]
    for at in range(len(scenes)):
        lit, (level, settings) = scenes.lamp[at] >= 0, levels[scenes.level[at]]
        column, row = places[int(scenes.place[at] * camera.n_places())]
        types, diameter = orders[scenes.order[at]], across_px[scenes.distance[at]]
        yield {
            "state": states[scenes.state[at]],
            "lamp": setup.lights.names[scenes.lamp[at]] if lit else None,
            "intensity_cd": vision.intensities_cd[scenes.intensity[at]] if lit else None,
            "background": vision.backgrounds[scenes.background[at]],
            "phantom": bool(scenes.phantom[at]),
            "distance_m": vision.distances_m[scenes.distance[at]],
            "level": level,
            "exposure_s": settings.exposure_s,
            "lens_diameter_px": diameter,
            "lenses": [vision.lenses[kind] for kind in types],
            "lens_x_px": [float(column)] * len(types),
            "lens_y_px": [float(row + diameter * height) for height in heights(vision)],
            "lit": int(np.flatnonzero(types == scenes.state[at] - 1)[0]) if lit else None,
        }
