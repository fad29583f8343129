"""One design in the benchmark: answers of the ideal observer and of a reader that learns to the same images."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import log_softmax, softmax

from ...base.types import Array, ChannelCurves, Float, ImageNumbers, IndexArray, Int
from ...camera.setup import Setup
from .batches import scene_key, scenes_of
from .crops import Crops, Seen
from .images import HeadCamera
from .keys import Vision
from .lamps import CHECK, TEST, TRAIN, split_lamps
from .observer import posteriors
from .prototypes import Prototypes
from .scenes import FIXED, ORDERS, PROTOTYPES, SHUFFLED, Scenes, draw_scenes

_KNOWN_KEY = 1
OBSERVER = "observer"
_SHARES = (1 / 64, 1 / 8, 1.0)
"""Of the images of training: error over images."""


@dataclass(frozen=True)
class Answers:
    """Probability of each state from readers of the same images, by reader."""

    scenes: Scenes
    probabilities: dict[str, Float[Array, "images states"]]


@dataclass(frozen=True)
class SeedReading:
    """Answers of one seed by order of the lenses, on lamps that the readers have not learned from, and on those.

    `learning`: answers to the unseen images in any order by readers of some images: name, their number, and states.
    """

    unseen: dict[str, Answers]
    seen: dict[str, Answers]
    learning: list[tuple[str, int, Int[IndexArray, " images"]]]


def read_images(setup: Setup, curves: ChannelCurves, vision: Vision, seed: tuple[int, int]) -> SeedReading:
    """Read the images of one design and one seed."""
    camera = HeadCamera(setup, curves, vision)
    lamps = split_lamps(setup.lights, vision, seed)
    crops = Crops(camera, lamps[TRAIN], seed)

    def seen_of(scenes: Scenes, order: str) -> Seen:
        return crops.seen(camera.images(scenes), scenes, fixed=order == FIXED)

    unseen: dict[str, Answers] = {}
    seen: dict[str, Answers] = {}
    shown: list[tuple[Answers, Seen]] = []
    for order in ORDERS:
        scenes = scenes_of(vision, lamps, order, TEST, seed)
        known = draw_scenes(vision, lamps[TRAIN], order, vision.test_images // 2, (*scene_key(seed, order), _KNOWN_KEY))
        # The observer of the lamps that were learned from is not asked for: the bound is that of the test.
        held = posteriors(camera, scenes, camera.images(scenes), lamps[TEST], order)
        unseen[order], seen[order] = Answers(scenes, {OBSERVER: held}), Answers(known, {})
        shown += [(unseen[order], seen_of(scenes, order)), (seen[order], seen_of(known, order))]
    check = scenes_of(vision, lamps, SHUFFLED, CHECK, seed)
    of_check, in_any_order = seen_of(check, SHUFFLED), shown[-2][1]
    learning: list[tuple[str, int, Int[IndexArray, " images"]]] = []
    if vision.prototypes:
        for images in (math.ceil(vision.prototype_images * share) for share in _SHARES):
            reader = Prototypes(crops, images)
            learning.append((PROTOTYPES, images, reader.log_probabilities(in_any_order).argmax(axis=1)))
        scale = 1 / _temperature(reader.log_probabilities(of_check), check.state)
        for answers, own in shown:
            answers.probabilities[PROTOTYPES] = softmax(scale * reader.log_probabilities(own), axis=1)
    return SeedReading(unseen, seen, learning)


def _temperature(logs: Float[Array, "images states"], states: ImageNumbers) -> float:
    """Return by which to divide for the largest likelihood (Guo et al., ICML 2017)."""

    def loss(log_temperature: float) -> float:
        log_shares = log_softmax(logs / math.exp(log_temperature), axis=1)
        return -float(np.take_along_axis(log_shares, states[:, None], axis=1).mean())

    return math.exp(minimize_scalar(loss, bounds=(-2.0, 3.0), method="bounded").x)


def observer_error(setup: Setup, curves: ChannelCurves, vision: Vision, seed: tuple[int, int]) -> float:
    """Return the expected error of the ideal observer on one seed's test images, with the lenses in any order.

    The mean of one less the probability of the most probable state, with less scatter than a count.
    """
    camera, order = HeadCamera(setup, curves, vision), ORDERS[-1]
    lamps = split_lamps(setup.lights, vision, seed)
    scenes = scenes_of(vision, lamps, order, TEST, seed)
    return float(np.mean(1 - posteriors(camera, scenes, camera.images(scenes), lamps[TEST], order).max(axis=1)))
