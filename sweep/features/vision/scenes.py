"""Scenes of a benchmark: one list for all CFAs, with the random numbers of their photons."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cache
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from ...base.types import Array, Float, ImageNumbers, IndexArray, Int
from .keys import Vision
from .lamps import Lamps

OFF = "off"
ALL = "all"
"""In place of a state, light level or distance: all of them."""
FIXED, SHUFFLED = "fixed", "shuffled"
ORDERS = (FIXED, SHUFFLED)
"""Order of the lenses: as in the street, so that the place of the lit one says its color, or any."""
SEEN, UNSEEN = "seen", "unseen"
"""Lamps of an image: used in the training of readers or not; the image itself never is."""
PHANTOM_SHARE = 0.5
PROTOTYPES = "prototypes"
"""Names of the readers that learn."""


@cache
def orders_of_lenses(n_lenses: int) -> Int[IndexArray, "orders lenses"]:
    """Return the signal type of the lens at each position from the top; the street's order is first."""
    return np.array(list(permutations(range(n_lenses))), dtype=np.intp)


def states_of(vision: Vision) -> tuple[str, ...]:
    """Return the possible answers of a reader: off, or the type of the lit lens."""
    return (OFF, *vision.lenses)


@dataclass(frozen=True)
class Scenes:
    """Scenes one by one.

    `state`: index into `states_of`; `lamp`: index of the lit signal; `intensity`, `background`, `distance`, `level`:
    index into the study's lists; `order`: into `orders_of_lenses`; `phantom`: 1 with sun on the lenses; `place`: where
    the head stands, as a share of all places; `key`: from which the photons are drawn.
    """

    state: ImageNumbers
    lamp: ImageNumbers
    intensity: ImageNumbers
    background: ImageNumbers
    distance: ImageNumbers
    level: ImageNumbers
    order: ImageNumbers
    phantom: ImageNumbers
    place: Float[Array, " images"]
    key: ImageNumbers

    def __len__(self) -> int:
        return len(self.state)

    def subset(self, which: Int[IndexArray, " which"] | NDArray[np.bool_] | slice) -> Scenes:
        """Return some of the scenes."""
        return Scenes(**{field.name: getattr(self, field.name)[which] for field in fields(self)})


def draw_scenes(vision: Vision, lamps: Lamps, order: str, count: int, key: tuple[int, ...]) -> Scenes:
    """Draw scenes, evenly over distances, levels and states, the rest at random; equal for all CFAs."""
    rng = np.random.default_rng(key)
    levels, at, n_orders = list(vision.levels.values()), np.arange(count), len(orders_of_lenses(len(vision.lenses)))
    n_distances, n_levels = len(vision.distances_m), len(levels)
    state = rng.permutation(at % (1 + len(vision.lenses)))
    condition = at % (n_distances * n_levels)
    distance, level = np.divmod(condition, n_levels)
    lit = np.maximum(state - 1, 0)
    which = rng.random(count)
    lamp = np.array([lamps.of_lens[k][int(u * len(lamps.of_lens[k]))] for k, u in zip(lit, which, strict=True)])
    sunny = np.array([light_level.phantom_cd > 0 for light_level in levels])
    return Scenes(
        state=state,
        lamp=np.where(state > 0, lamp, -1),
        intensity=rng.integers(len(vision.intensities_cd), size=count),
        background=rng.integers(len(vision.backgrounds), size=count),
        distance=distance,
        level=level,
        order=rng.integers(n_orders, size=count) if order == SHUFFLED else np.zeros(count, dtype=int),
        phantom=((rng.random(count) < PHANTOM_SHARE) & sunny[level]).astype(np.intp),
        place=rng.random(count),
        key=rng.integers(2**62, size=count),
    )


def uniforms(keys: ImageNumbers, n_pixels: int) -> Float[Array, "images pixels"]:
    """Return a random number from 0 to 1 for each pixel of each scene, equal for all CFAs.

    Each scene has its own counter-based generator (Philox), so that earlier draws do not matter.
    """
    return np.stack([np.random.Generator(np.random.Philox(key=int(key))).random(n_pixels) for key in keys])
