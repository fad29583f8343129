"""Crops of heads for readers that learn: the middle of images in units of the noise, drawn at once and not held.

A reader may ask for images of any labels, of the lamps of training. It sees no spectrum, no optics and no other lamp.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...base.types import ImageNumbers, IndexArray, Int
from ...camera.noise.merged_readings import ROOT_STEP
from .head import heights
from .image_kernels import draw_crops
from .images import HeadCamera, Numbers
from .keys import Vision
from .lamps import Lamps
from .planes import in_noise
from .scenes import PHANTOM_SHARE, Scenes, orders_of_lenses

_LEAST_REACH_PX = 6.0
"""Reach of a crop from the middle, at least; up to the centers of the outer lenses of the nearest head."""
_GUIDES = 128
_KEY_OF_CROPS = 30
Float32 = NDArray[np.float32]


class Heads(NamedTuple):
    """Labels of heads: type of the lit lens or -1, intensity, order, sun, place and background, by index."""

    kind: ImageNumbers
    intensity: ImageNumbers
    order: ImageNumbers
    sunny: ImageNumbers
    place: ImageNumbers
    background: ImageNumbers


@dataclass(frozen=True)
class Seen:
    """Crops and what every reader is told: distance, level, background, and whether the order is the street's."""

    crops: Float32
    distance: ImageNumbers
    level: ImageNumbers
    background: ImageNumbers
    fixed: bool

    def conditions(self) -> Iterator[tuple[tuple[int, int], ImageNumbers]]:
        """Yield each distance and level with its images."""
        for distance, level in np.unique(np.stack([self.distance, self.level], axis=1), axis=0):
            yield (int(distance), int(level)), np.flatnonzero((self.distance == distance) & (self.level == level))


class Crops:
    """Source of crops of one design before the lamps of one split."""

    def __init__(self, camera: HeadCamera, lamps: Lamps, seed: tuple[int, int]) -> None:
        vision, tile = camera.vision, camera.setup.camera.mosaic.indices.shape
        self._camera, self._lamps, self.vision = camera, lamps, vision
        self._rng = np.random.default_rng((*seed, _KEY_OF_CROPS))
        rows, columns = (reach_px(vision, size) for size in tile)
        side = np.arange(vision.crop_px)
        self._shape = rows.size, columns.size
        self._pixels = (side[rows][:, None] * vision.crop_px + side[columns]).ravel()
        self.n_places = camera.n_places()
        tiled = np.tile(camera.setup.camera.mosaic.indices, [-(-vision.crop_px // size) for size in tile])
        self.channels = tiled[: vision.crop_px, : vision.crop_px].ravel()[self._pixels]
        table = camera.table
        scaled = in_noise(table.values_dn, camera.pixel).astype(np.float32)
        # Of numbers: a node's first one at or above each share, from which a draw looks on.
        guide = np.stack([np.searchsorted(row, np.arange(_GUIDES) / _GUIDES) for row in table.below])
        below = table.below.copy()
        below[:, -1] = np.inf
        self._table = (
            *(table.nodes_e.astype(np.float32), table.node_of_root, ROOT_STEP),
            *(below, guide.astype(np.int16), scaled),
        )
        self._parts: dict[tuple[int, int], tuple[Float32, Float32, Float32]] = {}

    @cached_property
    def sunny(self) -> tuple[bool, ...]:
        """Whether there may be sun on the lenses, by level."""
        return tuple(level.phantom_cd > 0 for level in self._camera.levels)

    def random(self, level: int, count: int) -> Heads:
        """Draw labels as scenes have them, lenses in any order."""
        vision, rng = self.vision, self._rng
        n_kinds, n_orders = len(vision.lenses), len(orders_of_lenses(len(vision.lenses)))
        return Heads(
            kind=rng.integers(-1, n_kinds, size=count),
            intensity=rng.integers(len(vision.intensities_cd), size=count),
            order=rng.integers(n_orders, size=count),
            sunny=(rng.random(count) < PHANTOM_SHARE * self.sunny[level]).astype(np.intp),
            place=rng.integers(self.n_places, size=count),
            background=rng.integers(len(vision.backgrounds), size=count),
        )

    def draw(self, distance: int, level: int, heads: Heads) -> Float32:
        """Return a new image of each head, of lamps at random."""
        where, camera = (distance, level), self._camera
        if where not in self._parts:
            held = camera.electrons(distance, level)
            self._parts[where] = tuple(  # type: ignore[assignment]
                np.ascontiguousarray(part[..., self._pixels], dtype=np.float32)
                for part in (held.unlit, held.phantoms, held.lamps * held.time_s)
            )
        counts = np.array([len(members) for members in self._lamps.of_lens])
        starts = np.cumsum(counts) - counts
        which = (self._rng.random(len(heads.kind)) * counts[heads.kind]).astype(np.intp)
        lamp = np.where(heads.kind >= 0, np.concatenate(self._lamps.of_lens)[starts[heads.kind] + which], -1)
        light = np.array(camera.vision.intensities_cd, dtype=np.float32)[heads.intensity]
        labels = np.stack([heads.kind, lamp, heads.order, heads.sunny, heads.place, heads.background], axis=1)
        out = np.empty((len(labels), self._pixels.size), dtype=np.float32)
        orders, key = orders_of_lenses(len(self.vision.lenses)), int(self._rng.integers(2**62))
        draw_crops(self._parts[where], labels.astype(np.int32), light, orders, *self._table, key, out)
        return out

    def seen(self, numbers: Numbers, scenes: Scenes, *, fixed: bool) -> Seen:
        """Return the crops of drawn images."""
        crops = self._table[-1][numbers.reshape(len(numbers), -1)[:, self._pixels]]
        return Seen(crops, scenes.distance, scenes.level, scenes.background, fixed)


def reach_px(vision: Vision, tile: int) -> Int[IndexArray, " pixels"]:
    """Return the rows or columns of a crop: whole tiles about the middle."""
    extent_px = max(vision.target(distance).object_resolution_px for distance in vision.distances_m)
    reach = max(extent_px * float(heights(vision)[-1]), _LEAST_REACH_PX)
    half = vision.crop_px // 2
    middle, size = half // tile * tile, min(math.ceil(reach / tile), half // tile) * tile
    return np.arange(middle - size, middle + size)
