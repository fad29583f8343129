"""One design in the benchmark: answers of the ideal observer and of a reader that learns to the same images."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import log_softmax, softmax

from ..base.types import Array, ChannelCurves, Float, ImageNumbers, IndexArray, Int
from ..camera.setup import Setup
from .batches import scene_key, scenes_of
from .crops import Crops, Seen
from .detections import precisions
from .detector import Detector
from .images import HeadCamera
from .lamps import CHECK, TEST, TRAIN, Lamps, split_lamps
from .observer import posteriors
from .prototypes import Prototypes
from .scenes import FIXED, ORDERS, PROTOTYPES, SHUFFLED, Scenes, draw_scenes
from .section import Vision
from .street import StreetCamera, draw_streets, street_labels

_KNOWN_KEY = 1
_KEY = {"design_id": 0, "name": "", "cfa": "", "seed": 0}
"""Labels of images that are not written to files."""
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
    `precision` is that of a detector in streets and `lit` the number of lit lenses, by level
    and lens. Without streets they are empty.
    """

    unseen: dict[str, Answers]
    seen: dict[str, Answers]
    learning: list[tuple[str, int, Int[IndexArray, " images"]]]
    precision: Float[Array, "streets lenses"]
    lit: Int[IndexArray, "streets lenses"]


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
    return SeedReading(unseen, seen, learning, *_streets(camera, lamps, seed))


def _temperature(logs: Float[Array, "images states"], states: ImageNumbers) -> float:
    """Return by which to divide for the largest likelihood (Guo et al., ICML 2017)."""

    def loss(log_temperature: float) -> float:
        log_shares = log_softmax(logs / math.exp(log_temperature), axis=1)
        return -float(np.take_along_axis(log_shares, states[:, None], axis=1).mean())

    return math.exp(minimize_scalar(loss, bounds=(-2.0, 3.0), method="bounded").x)


def _streets(
    camera: HeadCamera, lamps: dict[str, Lamps], seed: tuple[int, int]
) -> tuple[Float[Array, "images lenses"], Int[IndexArray, "images lenses"]]:
    """Return the precision of the simplest detector, and the number of lit lenses."""
    vision, design = camera.vision, camera.setup.camera
    if vision.street is None:
        return np.empty((0, 0)), np.empty((0, 0), dtype=np.intp)
    streets, key = StreetCamera(camera, vision.street), _KEY | {"seed": seed[1]}
    learned, test = (draw_streets(vision, vision.street, split, seed) for split in (TRAIN, TEST))
    detector = Detector(design.mosaic, camera.pixel, vision.lenses)
    detector.learn(streets.batches(learned, lamps[TRAIN], key, TRAIN, "raw"))
    detections = detector.detect(streets.batches(test, lamps[TEST], key, TEST, "raw"))
    labels, shape = street_labels(vision, design.mosaic, test, key, TEST), (-1, len(vision.lenses))
    table = precisions(labels, detections, vision.lenses)
    precision, lit = table["average_precision"].to_numpy(dtype=float), table["lit"].to_numpy(dtype=np.intp)
    return precision.reshape(shape), lit.reshape(shape)


def observer_error(setup: Setup, curves: ChannelCurves, vision: Vision, seed: tuple[int, int]) -> float:
    """Return the expected error of the ideal observer on one seed's test images, with the lenses in any order.

    The mean of one less the probability of the most probable state, with less scatter than a count.
    """
    camera, order = HeadCamera(setup, curves, vision), ORDERS[-1]
    lamps = split_lamps(setup.lights, vision, seed)
    scenes = scenes_of(vision, lamps, order, TEST, seed)
    return float(np.mean(1 - posteriors(camera, scenes, camera.images(scenes), lamps[TEST], order).max(axis=1)))
