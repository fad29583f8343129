"""The ideal observer: it knows how images come about, and sums the likelihood over everything that is random.

It knows the lamps that the images show, and is told distance, light level and background, which the images themselves
show. It sums over the state, the lamp, its intensity, the sun on the lenses, their order, and the place of the head.
So no reader of these images is more often right on average.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..types import FloatArray, IndexArray
from .compiled_images import log_likelihoods
from .images import HeadCamera, Numbers
from .lamps import Lamps
from .scenes import ORDER_OF_LENSES, PHANTOM_SHARE, SHUFFLED, Scenes, states_of


@dataclass(frozen=True)
class _Cases:
    """All that a head can be, one by one: ndarray[n_cases] each; `share`: how frequent it is in its state."""

    state: IndexArray
    lamp: IndexArray
    intensity: IndexArray
    order: IndexArray
    phantom: IndexArray
    place: IndexArray
    share: FloatArray


def _cases(camera: HeadCamera, lamps: Lamps, order: str, sunny: bool) -> _Cases:
    vision = camera.vision
    n_orders = len(ORDER_OF_LENSES) if order == SHUFFLED else 1
    rest = np.array(
        [(o, p, at) for o in range(n_orders) for p in range(1 + sunny) for at in range(camera.n_places())]
    )
    sun = np.where(rest[:, 1] == 1, PHANTOM_SHARE, 1 - PHANTOM_SHARE) if sunny else np.ones(len(rest))
    weight = sun / (n_orders * camera.n_places())
    lit = [(0, -1, 0, 1.0)]
    for kind, own in enumerate(lamps.of_lens):
        each = 1 / (len(own) * len(vision.intensities_cd))
        lit += [(1 + kind, int(lamp), i, each) for lamp in own for i in range(len(vision.intensities_cd))]
    table = np.array(lit)
    first, second = (a.ravel() for a in np.meshgrid(np.arange(len(lit)), np.arange(len(rest)), indexing="ij"))
    whole = table[first][:, :3].astype(np.intp)
    return _Cases(*whole.T, *rest[second].T.astype(np.intp), table[first, 3] * weight[second])


def posteriors(camera: HeadCamera, scenes: Scenes, images: Numbers, lamps: Lamps, order: str) -> FloatArray:
    """Probability of each state given each image, ndarray[n_images, n_states]; all states are equally frequent.

    `lamps`, `order`: from which the scenes were drawn.
    """
    found = np.empty((len(scenes), len(states_of(camera.vision))))
    groups = np.stack([scenes.distance, scenes.level, scenes.background], axis=1)
    for distance, level in np.unique(groups[:, :2], axis=0):
        heads = camera.electrons(int(distance), int(level))
        cases = _cases(camera, lamps, order, camera.levels[level].phantom_cd > 0)
        candelas = np.array(camera.vision.intensities_cd)[cases.intensity]
        for background in np.unique(groups[(groups[:, 0] == distance) & (groups[:, 1] == level), 2]):
            here = np.flatnonzero((groups == (distance, level, background)).all(axis=1))
            ground = np.full(len(cases.state), background)
            lit = (cases.state - 1, cases.lamp, candelas)
            electrons = heads.of(cases.place, ground, cases.order, cases.phantom, lit)
            found[here] = _of_states(camera, images[here].reshape(len(here), -1), electrons, cases)
    return found


def _of_states(camera: HeadCamera, images: Numbers, electrons: FloatArray, cases: _Cases) -> FloatArray:
    """Probability of each state, ndarray[n_images, n_states]; `electrons`: of each case, ndarray[n_cases, n_pixels]."""
    telling = np.argsort(-np.sqrt(electrons).std(axis=0), kind="stable")
    node, share = camera.table.at(np.ascontiguousarray(electrons[:, telling]))
    numbers = np.ascontiguousarray(images[:, telling])
    likelihood = np.empty((len(images), len(electrons)))
    log_likelihoods(numbers, node, share, camera.table.shares, likelihood)
    likelihood -= likelihood.max(axis=1, keepdims=True)
    weights = np.exp(likelihood) * cases.share
    own = cases.state[:, None] == np.arange(1 + len(camera.vision.lenses))
    found = weights @ own.astype(float)
    return np.asarray(found / found.sum(axis=1, keepdims=True), dtype=float)
