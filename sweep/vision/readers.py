"""One design in the benchmark: answers of the ideal observer and the network to the same images, for one seed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..base.types import Array, ChannelCurves, Float, FloatArray, IndexArray, Int
from ..camera.setup import Setup
from .batches import batches, images_of_split, scene_key, scenes_of
from .detections import precisions
from .detector import Detector
from .images import HeadCamera
from .lamps import CHECK, TEST, TRAIN, Lamps, split_lamps
from .observer import posteriors
from .scenes import NETWORK, ORDERS, Scenes, draw_scenes
from .section import Vision
from .street import StreetCamera, draw_streets, street_labels

if TYPE_CHECKING:
    from .network_reader import NetworkReader

"""Images that were read wrongly and are kept to look at, of each design."""
_KNOWN_KEY = 1
_KEY = {"design_id": 0, "name": "", "cfa": "", "seed": 0}
"""Labels of images that are not written to files."""
OBSERVER = "observer"


@dataclass(frozen=True)
class Answers:
    """Probability of each state from readers of the same images, by reader."""

    scenes: Scenes
    probabilities: dict[str, Float[Array, "images states"]]


@dataclass(frozen=True)
class SeedReading:
    """Answers of one seed by order of the lenses, on lamps that the network has not seen, and on those it has.

    `precision` is that of a detector in streets and `lit` the number of lit lenses, by level
    and lens. Without streets they are empty.
    """

    unseen: dict[str, Answers]
    seen: dict[str, Answers]
    precision: Float[Array, "streets lenses"]
    lit: Int[IndexArray, "streets lenses"]


def read_images(setup: Setup, curves: ChannelCurves, vision: Vision, seed: tuple[int, int]) -> SeedReading:
    """Read the images of one design and one seed."""
    camera = HeadCamera(setup, curves, vision)
    lamps = split_lamps(setup.lights, vision, seed)
    reader = _network(camera, lamps, seed) if vision.network else None
    unseen: dict[str, Answers] = {}
    seen: dict[str, Answers] = {}
    for order in ORDERS:
        scenes = scenes_of(vision, lamps, order, TEST, seed)
        known_scenes = draw_scenes(
            vision, lamps[TRAIN], order, vision.test_images // 2, (*scene_key(seed, order), _KNOWN_KEY)
        )
        # The observer of the lamps that were learned from is not asked for: the bound is that of the test.
        images = camera.images(scenes)
        answers = {OBSERVER: posteriors(camera, scenes, images, lamps[TEST], order)}
        known: dict[str, FloatArray] = {}
        if reader is not None:
            answers[NETWORK] = reader.read(batches(camera, scenes, _KEY, order, TEST, "raw"))
            known[NETWORK] = reader.read(batches(camera, known_scenes, _KEY, order, TEST, "raw"))
        unseen[order], seen[order] = Answers(scenes, answers), Answers(known_scenes, known)
    return SeedReading(unseen, seen, *_streets(camera, lamps, seed))


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


def _network(camera: HeadCamera, lamps: dict[str, Lamps], seed: tuple[int, int]) -> NetworkReader:
    from .network_reader import NetworkReader  # noqa: PLC0415  (JAX: only where a study asks for a network)

    reader = NetworkReader(camera.vision, camera.setup.camera.mosaic, camera.pixel)
    key = _KEY | {"seed": seed[1]}
    training, check = (images_of_split(camera, lamps, key, seed[0], split, "raw") for split in (TRAIN, CHECK))
    reader.learn(training, check, seed)
    return reader
