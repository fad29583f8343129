"""Labeled images of a design, block by block: what the readers of a run, exported files and Python get."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...base.types import IndexArray, Int
from .head import head_places_px, heights
from .images import HeadCamera, Numbers
from .isp import isp_of
from .keys import Vision
from .lamps import CHECK, TEST, TRAIN, Lamps
from .planes import demosaicked
from .scenes import ORDERS, SHUFFLED, Scenes, draw_scenes, orders_of_lenses, states_of

Form = Literal["raw", "demosaicked", "isp"]
"""Raw mosaics (uint16 DN, float32 of HDR pixels), every channel at every pixel (float32 DN above the black level), or
pictures of a plain ISP (uint8 sRGB)."""
FORMS = get_args(Form)
TOGETHER = 1024
"""Images that are held at once."""
_STRIP_ROWS = 128
"""Rows of images that are developed at once, about."""
_KEYS = {TEST: 0, TRAIN: 2, CHECK: 3}
"""Last number of the seed of each split's scenes."""


class Batch(NamedTuple):
    """Images, raw or with channels on the last axis, and a row of labels for each."""

    images: NDArray[Any]
    labels: pd.DataFrame


def image_id(design_id: int, seed: int, order: str, split: str, number: int) -> str:
    """Return the name of an image in manifests and predictions."""
    return f"{design_id}-{seed}-{order}-{split}-{number}"


def scenes_of(vision: Vision, lamps: dict[str, Lamps], order: str, split: str, seed: tuple[int, int]) -> Scenes:
    """Return the scenes of a split."""
    return draw_scenes(vision, lamps[split], order, vision.images_of(split), (*scene_key(seed, order), _KEYS[split]))


def scene_key(seed: tuple[int, int], order: str) -> tuple[int, ...]:
    """Return the start of the seed of scenes.

    `seed`: that of the study, and the number of this one.
    """
    return (*seed, 10 + ORDERS.index(order))


def batches(
    camera: HeadCamera,
    scenes: Scenes,
    key: Mapping[str, Any],
    order: str,
    split: str,
    form: Form,
    some: slice = slice(None),
) -> Iterator[Batch]:
    """Yield the images of scenes, or of some, in blocks of `TOGETHER`.

    `key`: `design_id`, `name`, `cfa` and `seed`, for the labels.
    """
    first, last, _ = some.indices(len(scenes))
    for start in range(first, last, TOGETHER):
        block = scenes.subset(slice(start, min(start + TOGETHER, last)))
        numbers = np.arange(start, start + len(block))
        ids = {"image_id": [image_id(key["design_id"], key["seed"], order, split, int(number)) for number in numbers]}
        where = {"order": order, "split": split, "image": numbers}
        labels = pd.DataFrame({**ids, **key, **where, **_labels(camera, block)})
        yield Batch(formed(camera, block, form), labels)


def images_of_split(
    camera: HeadCamera, lamps: dict[str, Lamps], key: Mapping[str, Any], seed: int, split: str, form: Form
) -> Iterator[Batch]:
    """Yield the images of a split: of the test with lenses in the street's order, then in any; of others in any."""
    for order in ORDERS if split == TEST else (SHUFFLED,):
        scenes = scenes_of(camera.vision, lamps, order, split, (seed, key["seed"]))
        yield from batches(camera, scenes, key, order, split, form)


def _labels(camera: HeadCamera, scenes: Scenes) -> dict[str, Any]:
    """Return state, geometry and light of each scene."""
    vision, setup = camera.vision, camera.setup
    lit, levels = scenes.lamp >= 0, vision.levels
    kinds = orders_of_lenses(len(vision.lenses))
    columns, rows = head_places_px(vision, setup.camera.mosaic).T
    place = (scenes.place * camera.n_places()).astype(np.intp)
    across_px = np.array([vision.target(distance).object_resolution_px for distance in vision.distances_m])
    diameter_px = across_px[scenes.distance]
    y_px = rows[place][:, None] + diameter_px[:, None] * heights(vision)
    position = (kinds[scenes.order] == (scenes.state - 1)[:, None]).argmax(axis=1)
    names_of_order = [[vision.lenses[kind] for kind in order] for order in kinds]
    return {
        "state": np.array(states_of(vision), dtype=object)[scenes.state],
        "lamp": np.array([*setup.lights.names, None], dtype=object)[scenes.lamp],  # -1: none
        "intensity_cd": np.where(lit, np.array(vision.intensities_cd)[scenes.intensity], np.nan),
        "background": np.array(vision.backgrounds, dtype=object)[scenes.background],
        "phantom": scenes.phantom.astype(bool),
        "distance_m": np.array(vision.distances_m, dtype=float)[scenes.distance],
        "level": np.array(list(levels), dtype=object)[scenes.level],
        "exposure_s": np.array([level.exposure_s for level in levels.values()])[scenes.level],
        "lens_diameter_px": diameter_px,
        "lenses": [names_of_order[order] for order in scenes.order],
        "lens_x_px": np.repeat(columns[place][:, None], len(vision.lenses), axis=1).tolist(),
        "lens_y_px": y_px.tolist(),
        "lit": pd.Series(position, dtype="Int64").where(lit),
    }


def formed(camera: HeadCamera, scenes: Scenes, form: Form) -> NDArray[Any]:
    """Return images of scenes in a form."""
    return in_form(camera, camera.images(scenes), scenes.level, form)


def in_form(camera: HeadCamera, numbers: Numbers, levels: Int[IndexArray, " values"], form: Form) -> NDArray[Any]:
    """Return drawn images in a form."""
    values_dn, pixel = camera.table.values_dn, camera.pixel
    if form == "raw":
        dn = values_dn[numbers]
        return dn.astype(np.float32) if pixel.captures else np.rint(dn).astype(np.uint16)
    mosaic = camera.setup.camera.mosaic
    is_linear = form == "demosaicked"
    channels = len(mosaic.channels) if is_linear else 3
    images: NDArray[Any] = np.empty((*numbers.shape, channels), dtype=np.float32 if is_linear else np.uint8)
    lights = np.array([level.light for level in camera.levels])[levels]
    isps = (
        {} if is_linear else {light: isp_of(camera.setup.camera.grid, camera.qe, light) for light in np.unique(lights)}
    )
    # Strip by strip, each with a tile more on both sides, as far as a tent reaches.
    tile = mosaic.indices.shape[0]
    high = tile * (_STRIP_ROWS // tile + 1)
    for top in range(0, numbers.shape[1], high):
        first = max(top - tile, 0)
        strip = demosaicked(values_dn[numbers[:, first : top + high + tile]], mosaic)[:, top - first :][:, :high]
        strip -= pixel.offset_dn
        if is_linear:
            images[:, top : top + high] = strip
        for light, isp in isps.items():
            here = lights == light
            images[here, top : top + high] = isp.developed(strip[here] / (values_dn[-1] - pixel.offset_dn))
    return images
