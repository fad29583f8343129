"""One design in the benchmark: answers of the ideal observer and the network to the same images, for one seed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.types import FloatArray
from ..camera.setup import Setup
from .images import HeadCamera, Numbers
from .lamps import CHECK, TEST, TRAIN, Lamps, split_lamps
from .observer import posteriors
from .planes import demosaicked, false_colors, tile_planes
from .scenes import ORDERS, Scenes, draw_scenes, states_of
from .section import Vision

_SHOWN = 12
"""Images that were read wrongly and are kept to look at, of each design."""


@dataclass(frozen=True)
class Answers:
    """Probability of each state from readers of the same images, ndarray of shape (n, n_states) each.

    `half` is a network that learned from half of the images. Without a network both are empty.
    """

    scenes: Scenes
    observer: FloatArray
    network: FloatArray
    half: FloatArray
    epochs: int


@dataclass(frozen=True)
class SeedReading:
    """Answers of one seed by order of the lenses, on lamps that the network has not seen, and on those it has.

    `pictures` are wrongly read images in false colors, [n, rows, columns, 3]; `pictured` their numbers among the
    images with lenses in any order.
    """

    unseen: dict[str, Answers]
    seen: dict[str, Answers]
    pictures: FloatArray
    pictured: list[int]


def read_images(setup: Setup, curves: FloatArray, vision: Vision, seed: tuple[int, int]) -> SeedReading:
    """Read the images of one design and one seed.

    Parameters
    ----------
    setup : Setup
        Scene and camera.
    curves : ndarray of shape (n_modified, n_wavelengths)
        QE of the modified channels.
    vision : Vision
        Benchmark.
    seed : tuple of int
        Seed of the study, and number of this seed.

    Returns
    -------
    SeedReading
        Answers.
    """
    camera = HeadCamera(setup, curves, vision)
    lamps = split_lamps(setup.lights, vision, seed)
    unseen: dict[str, Answers] = {}
    seen: dict[str, Answers] = {}
    for order in ORDERS:
        scenes = scenes_of(vision, lamps, order, TEST, seed)
        known_scenes = draw_scenes(
            vision, lamps[TRAIN], order, vision.test_images // 2, (*_key(seed, order), _KNOWN_KEY)
        )
        test, known = ((some, camera.images(some)) for some in (scenes, known_scenes))
        answers = _of_networks(camera, lamps, order, seed, [test[1], known[1]]) if vision.network else _none()
        for where, (scenes, images), whole, half, of in zip(
            (unseen, seen), (test, known), *answers[:2], (lamps[TEST], lamps[TRAIN]), strict=True
        ):
            # The observer of the lamps that were learned from is not asked for: the bound is that of the test.
            ideal = posteriors(camera, scenes, images, of, order) if where is unseen else np.empty((0, 0))
            where[order] = Answers(scenes, ideal, whole, half, answers[2])
    return SeedReading(unseen, seen, *_pictures(camera, unseen[ORDERS[-1]], test[1]))


def observer_error(setup: Setup, curves: FloatArray, vision: Vision, seed: tuple[int, int]) -> float:
    """Return the expected error of the ideal observer on one seed's test images, with the lenses in any order.

    The mean of one less the probability of the most probable state, with less scatter than a count.

    Parameters
    ----------
    setup : Setup
        Scene and camera.
    curves : ndarray of shape (n_modified, n_wavelengths)
        QE of the modified channels.
    vision : Vision
        Benchmark.
    seed : tuple of int
        Seed of the study, and number of this seed.

    Returns
    -------
    float
        Error probability.
    """
    camera, order = HeadCamera(setup, curves, vision), ORDERS[-1]
    lamps = split_lamps(setup.lights, vision, seed)
    scenes = scenes_of(vision, lamps, order, TEST, seed)
    return float(np.mean(1 - posteriors(camera, scenes, camera.images(scenes), lamps[TEST], order).max(axis=1)))


_KEYS = {TEST: 0, TRAIN: 2, CHECK: 3}
"""Last number of the seed of each part's scenes."""
_KNOWN_KEY = 1


def scenes_of(vision: Vision, lamps: dict[str, Lamps], order: str, part: str, seed: tuple[int, int]) -> Scenes:
    """Return the scenes of a part of the images.

    Parameters
    ----------
    vision : Vision
        Benchmark.
    lamps : dict of str to Lamps
        Lamps of each part.
    order : str
        Order of the lenses.
    part : str
        One of `lamps.PARTS`.
    seed : tuple of int
        Seed of the study, and number of this seed.

    Returns
    -------
    Scenes
        Scenes.
    """
    count = {TEST: vision.test_images, TRAIN: vision.train_images, CHECK: vision.check_images}[part]
    return draw_scenes(vision, lamps[part], order, count, (*_key(seed, order), _KEYS[part]))


def _key(seed: tuple[int, int], order: str) -> tuple[int, ...]:
    return (*seed, 10 + ORDERS.index(order))


def planes_of(camera: HeadCamera, images: Numbers) -> FloatArray:
    """Return the input of the network: roots of the values above the pedestal, whose noise is uniform.

    Parameters
    ----------
    camera : HeadCamera
        Design.
    images : ndarray
        Digital numbers.

    Returns
    -------
    ndarray
        Raw pixels by tile position, or every channel at every pixel, as the study asks.
    """
    offset_dn, values_dn, mosaic = camera.pixel.offset_dn, camera.table.values_dn, camera.setup.camera.mosaic
    whole = camera.vision.input == "demosaicked"
    raw = values_dn[images]
    numbers = demosaicked(raw, mosaic) if whole else tile_planes(raw, mosaic)
    light = np.maximum(numbers - offset_dn, 0.0) / (values_dn[-1] - offset_dn)
    return np.asarray(np.sqrt(light), dtype=float)


def _none() -> tuple[list[FloatArray], list[FloatArray], int]:
    return [np.empty((0, 0))] * 2, [np.empty((0, 0))] * 2, 0


def _of_networks(
    camera: HeadCamera, lamps: dict[str, Lamps], order: str, seed: tuple[int, int], tests: list[Numbers]
) -> tuple[list[FloatArray], list[FloatArray], int]:
    """Return the answers of networks trained on all images and on half of them, and the epochs of the first."""
    from .network import train  # noqa: PLC0415  (JAX: only where a study asks for a network)

    vision = camera.vision
    scenes, checked = (scenes_of(vision, lamps, order, part, seed) for part in (TRAIN, CHECK))
    planes = planes_of(camera, camera.images(scenes))
    held_out = planes_of(camera, camera.images(checked)), checked.state
    probabilities, epochs = [], []
    for count in (len(scenes), len(scenes) // 2):
        some = slice(0, count)
        n_states = len(states_of(vision))
        network = train(planes[some], scenes.state[some], held_out, n_states, vision.epochs, (*_key(seed, order), 4))
        probabilities.append([network.probabilities(planes_of(camera, test_images)) for test_images in tests])
        epochs.append(network.epochs)
    return probabilities[0], probabilities[1], epochs[0]


def _pictures(camera: HeadCamera, answers: Answers, images: Numbers) -> tuple[FloatArray, list[int]]:
    """Return images that the network (without one, the observer) read wrongly, up to a number."""
    probabilities = answers.network if answers.network.size else answers.observer
    wrong = np.flatnonzero(probabilities.argmax(axis=1) != answers.scenes.state)[:_SHOWN]
    curves = camera.qe
    mean_nm = curves @ camera.setup.camera.grid.nodes_nm / np.maximum(curves.sum(axis=1), 1e-300)
    mosaic, offset = camera.setup.camera.mosaic, camera.pixel.offset_dn
    shown = [false_colors(camera.table.values_dn[images[at]], mosaic, mean_nm, offset) for at in wrong]
    side = camera.vision.crop_px
    return np.array(shown).reshape(-1, side, side, 3), [int(at) for at in wrong]
