"""Images of a street: several heads at different distances, among brake lamps and street lamps."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from functools import cache
from typing import Any

import numpy as np
import pandas as pd

from ...base.types import Array, Float, IndexArray, Int
from ...camera.mosaic import Mosaic
from ...spectra.builtin.groups import spectra_of_group
from .batches import Batch, Form, image_id, in_form
from .head import head_places_px, heights, housing_diameters
from .images import HeadCamera
from .keys import Illuminant, Street, Vision
from .lamps import CHECK, TEST, TRAIN, Lamps
from .materials import ambient_light
from .scenes import PHANTOM_SHARE, states_of

STREET = "street"
"""In place of the order of the lenses in the names of images."""
_HEAD, _BRAKE, _STREET_LAMP = range(3)
_JITTER_PX = 12
_BRAKE_CD, _STREET_CD = (60.0, 260.0), (500.0, 5000.0)
_KEY_OF_STREET = 20
_AT_ONCE_PIXELS, _MOST_AT_ONCE = 2**20, 32
_IDS_OF_SPLIT = 10**12
MOST_ROWS, MOST_COLUMNS = 1208, 1920
"""Largest street, pixels: a crop of the sensor."""
_BRAKE_GROUP = "brake red"
_STREET_LIGHTS: tuple[Illuminant, ...] = ("LED street light", "sodium street light")


@dataclass(frozen=True)
class StreetScenes:
    """Streets; of several lamps, heads come first.

    `level`, `background`, `distance`: index into the study's lists; `phantom`: 1 with sun on the lenses; `cell`: cell
    of the grid; `place`, `aside`, `below`: position in it, as shares; `state`: index into `states_of`; `lamp`: which of
    the lamps of that type, as a share of all; `candelas`: intensity, 0 for what is not lit; `key`: from which the
    photons are drawn.
    """

    level: Int[IndexArray, " streets"]
    background: Int[IndexArray, " streets"]
    phantom: Int[IndexArray, " streets"]
    key: Int[IndexArray, " streets"]
    cell: Int[IndexArray, "streets heads"]
    place: Float[Array, "streets heads"]
    aside: Float[Array, "streets heads"]
    below: Float[Array, "streets heads"]
    distance: Int[IndexArray, "streets heads"]
    state: Int[IndexArray, "streets heads"]
    lamp: Float[Array, "streets heads"]
    candelas: Float[Array, "streets heads"]

    def __len__(self) -> int:
        return len(self.level)

    def subset(self, which: slice) -> StreetScenes:
        """Return some of the streets."""
        return StreetScenes(**{field.name: getattr(self, field.name)[which] for field in fields(self)})


def draw_streets(vision: Vision, street: Street, split: str, seed: tuple[int, int]) -> StreetScenes:
    """Draw streets, evenly over the light levels, the rest at random; equal for all CFAs."""
    rng = np.random.default_rng((*seed, _KEY_OF_STREET, (TRAIN, TEST, CHECK).index(split)))
    n = count_of(street, split)
    levels = list(vision.levels.values())
    level = np.arange(n) % len(levels)
    kinds = kinds_of(street)
    shape = (n, kinds.size)
    state = np.where(kinds == _HEAD, rng.integers(1 + len(vision.lenses), size=shape), 0)
    lamp = rng.random(shape)
    daylight = np.array([light_level.light == "daylight" for light_level in levels])[level]
    of_signals = np.array(vision.intensities_cd)[rng.integers(len(vision.intensities_cd), size=shape)]
    u = rng.random(shape)
    of_brake, of_street = (low * (high / low) ** u for low, high in (_BRAKE_CD, _STREET_CD))
    candelas = np.select(
        [kinds == _HEAD, kinds == _BRAKE],
        [np.where(state > 0, of_signals, 0.0), of_brake],
        np.where(daylight[:, None], 0.0, of_street),
    )
    sunny = np.array([light_level.phantom_cd > 0 for light_level in levels])[level]
    cells = np.stack([rng.permutation(street.columns * street.rows)[: kinds.size] for _ in range(n)])
    return StreetScenes(
        level=level,
        background=rng.integers(len(vision.backgrounds), size=n),
        phantom=((rng.random(n) < PHANTOM_SHARE) & sunny).astype(np.intp),
        key=rng.integers(2**62, size=n),
        cell=cells,
        place=rng.random(shape),
        aside=rng.random(shape),
        below=rng.random(shape),
        distance=rng.integers(len(vision.distances_m), size=shape),
        state=state,
        lamp=lamp,
        candelas=candelas,
    )


def count_of(street: Street, split: str) -> int:
    """Return the number of streets of a split, of each seed and CFA."""
    return {TRAIN: street.train_images, CHECK: street.check_images, TEST: street.test_images}[split]


def kinds_of(street: Street) -> Int[IndexArray, " lamps"]:
    """Return the kind of each head and lamp: 0 for heads, 1 for brake lamps, 2 for street lamps."""
    return np.repeat([_HEAD, _BRAKE, _STREET_LAMP], [street.heads, street.brake_lamps, street.street_lamps])


def cell_shape(vision: Vision, tile: tuple[int, ...]) -> tuple[int, int]:
    """Return the size of a cell: of the image of a head, and how far it may stand aside.

    Returns rows and columns, pixels.
    """
    rows, columns = (vision.crop_px + _JITTER_PX // size * size for size in tile)
    return rows, columns


def street_shape(vision: Vision, tile: tuple[int, ...]) -> tuple[int, int]:
    """Return the size of an image of a street, pixels."""
    assert vision.street is not None
    rows, columns = cell_shape(vision, tile)
    return vision.street.rows * rows, vision.street.columns * columns


class StreetCamera:
    """One design before streets."""

    def __init__(self, camera: HeadCamera, street: Street) -> None:
        self.camera = camera
        self.street = street
        tile = camera.setup.camera.mosaic.indices.shape
        self._tile = tile
        self.shape = street_shape(camera.vision, tile)
        grid = camera.setup.camera.grid
        spectra = {_BRAKE: spectra_of_group(grid, _BRAKE_GROUP)}
        spectra[_STREET_LAMP] = np.stack([ambient_light(grid, name) for name in _STREET_LIGHTS])
        self._rates = cache(lambda distance, kind: camera.lamps(distance, spectra[kind]))
        self._backgrounds = cache(camera.background)

    def expected(self, scenes: StreetScenes, lamps: Lamps) -> Float[Array, "images rows columns"]:
        """Return expected electrons."""
        camera, side, kinds = self.camera, self.camera.vision.crop_px, kinds_of(self.street)
        corners = corners_px(camera.vision, self._tile, scenes)
        images = np.empty((len(scenes), *self.shape))
        repeats = [-(-size // side) for size in self.shape]
        for i in range(len(scenes)):
            level, behind = int(scenes.level[i]), int(scenes.background[i])
            around = self._backgrounds(level)[behind]
            images[i] = np.tile(around.reshape(side, side), repeats)[: self.shape[0], : self.shape[1]]
            for j, kind in enumerate(kinds):
                electrons = self._one(scenes, lamps, (i, j, int(kind)), around)
                row, column = corners[i, j]
                images[i, row : row + side, column : column + side] += electrons.reshape(side, side)
            dark_e = camera.pixel.dark_e_per_s * camera.levels[level].exposure_s
            images[i] = self._with_glare(np.maximum(images[i], dark_e) - dark_e) + dark_e
        return images

    def _one(
        self, scenes: StreetScenes, lamps: Lamps, which: tuple[int, int, int], around: Float[Array, " pixels"]
    ) -> Float[Array, " pixels"]:
        """Return electrons that one head or lamp (image, number, kind) adds to the background."""
        i, j, kind = which
        camera, level, distance = self.camera, int(scenes.level[i]), int(scenes.distance[i, j])
        place, share = int(scenes.place[i, j] * camera.n_places()), float(scenes.lamp[i, j])
        if kind != _HEAD:
            rates = self._rates(distance, kind)[place]
            of_lamp = rates[int(share * len(rates))]
            return np.asarray(of_lamp * (scenes.candelas[i, j] * camera.levels[level].exposure_s), dtype=float)
        state = scenes.state[i, j : j + 1] - 1
        members = lamps.of_lens[max(int(state[0]), 0)]
        lit = state, members[[int(share * len(members))]], scenes.candelas[i, j : j + 1]
        behind, phantom = scenes.background[i : i + 1], scenes.phantom[i : i + 1]
        electrons = camera.electrons(distance, level)
        head = electrons.of(np.array([place]), behind, np.zeros(1, dtype=np.intp), phantom, lit)[0]
        return np.asarray(head - around, dtype=float)

    def _with_glare(self, image: Float[Array, "rows columns"]) -> Float[Array, "rows columns"]:
        """Spread a share of the mean light of each position of the tile evenly."""
        share, (rows, columns) = self.street.veiling_glare, self._tile
        if not share:
            return image
        means = image.reshape(self.shape[0] // rows, rows, self.shape[1] // columns, columns).mean(axis=(0, 2))
        tiled_means = np.tile(means, (self.shape[0] // rows, self.shape[1] // columns))
        return np.asarray((1 - share) * image + share * tiled_means, dtype=float)

    def batches(
        self,
        scenes: StreetScenes,
        lamps: Lamps,
        key: Mapping[str, Any],
        split: str,
        form: Form,
        some: slice = slice(None),
    ) -> Iterator[Batch]:
        """Yield images with labels, or those of some, a few at once."""
        labels = street_labels(self.camera.vision, self.camera.setup.camera.mosaic, scenes, key, split, some)
        first, last, _ = some.indices(len(scenes))
        step = max(1, min(_MOST_AT_ONCE, _AT_ONCE_PIXELS // (self.shape[0] * self.shape[1])))
        for start in range(first, last, step):
            block = scenes.subset(slice(start, min(start + step, last)))
            numbers = self.camera.drawn(self.expected(block, lamps).reshape(len(block), -1), block.key)
            images = in_form(self.camera, numbers.reshape(-1, *self.shape), block.level, form)
            yield Batch(images, labels.iloc[start - first : start - first + len(block)].reset_index(drop=True))


def corners_px(vision: Vision, tile: tuple[int, ...], scenes: StreetScenes) -> Int[IndexArray, "images lamps 2"]:
    """Return the first row and column of each head's or lamp's image."""
    assert vision.street is not None
    at = np.stack(np.divmod(scenes.cell, vision.street.columns), axis=2)
    steps = [share * (_JITTER_PX // size + 1) for share, size in zip((scenes.below, scenes.aside), tile, strict=True)]
    corners: IndexArray = at * np.array(cell_shape(vision, tile)) + np.stack(steps, axis=2).astype(np.intp) * tile
    return corners


def street_labels(
    vision: Vision,
    mosaic: Mosaic,
    scenes: StreetScenes,
    key: Mapping[str, Any],
    split: str,
    some: slice = slice(None),
) -> pd.DataFrame:
    """Return the labels of streets, or of some.

    Returns a row per image, lists with an entry for each head; `coco_id` is a number of the image.
    """
    assert vision.street is not None
    numbers, count = np.arange(len(scenes))[some], len(scenes)
    scenes = scenes.subset(some)
    heads, places = slice(0, vision.street.heads), head_places_px(vision, mosaic)
    middle = places[(scenes.place[:, heads] * len(places)).astype(np.intp)]
    corners = corners_px(vision, mosaic.indices.shape, scenes)[:, heads]
    across_px = np.array([vision.target(distance).object_resolution_px for distance in vision.distances_m])
    diameter_px = across_px[scenes.distance[:, heads]]
    x_px, y_px = corners[..., 1] + middle[..., 0], corners[..., 0] + middle[..., 1]
    state = scenes.state[:, heads]
    lit_y_px = y_px + diameter_px * np.append(0.0, heights(vision))[state]
    wide, high = housing_diameters(vision)
    ids = [image_id(key["design_id"], key["seed"], STREET, split, int(number)) for number in numbers]
    where = {"image_id": ids, **key, "order": STREET, "split": split, "image": numbers}
    before = (key["design_id"] * vision.seeds + key["seed"]) * count
    where["coco_id"] = (TEST, CHECK, TRAIN).index(split) * _IDS_OF_SPLIT + before + numbers + 1
    return pd.DataFrame(where).assign(
        background=np.array(vision.backgrounds, dtype=object)[scenes.background],
        level=np.array(list(vision.levels), dtype=object)[scenes.level],
        phantom=scenes.phantom.astype(bool),
        state=np.array(states_of(vision), dtype=object)[state].tolist(),
        intensity_cd=np.where(state > 0, scenes.candelas[:, heads], np.nan).tolist(),
        distance_m=np.array(vision.distances_m, dtype=float)[scenes.distance[:, heads]].tolist(),
        lens_diameter_px=diameter_px.tolist(),
        head_x_px=x_px.tolist(),
        head_y_px=y_px.tolist(),
        lit_y_px=np.where(state > 0, lit_y_px, np.nan).tolist(),
        head_width_px=(wide * diameter_px).tolist(),
        head_height_px=(high * diameter_px).tolist(),
    )
