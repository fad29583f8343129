"""Ideal observer: it knows how images arise, and sums the likelihood over everything that is random.

It knows the lamps that the images show, and is given distance, light level and background, which the images themselves
show. It sums over the state, the lamp, its intensity, the sun on the lenses, their order, and the position of the
head. On average no reader of these images is more often right.

Between two nodes of the pixel's table images are drawn from a mixture, of which it takes the mean of the logarithms:
less than 0.002 of a pixel's log-likelihood.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base.types import Array, Float, IndexArray, Int
from ...camera.noise.merged_readings import ROOT_STEP
from .image_kernels import cases_on_table, log_likelihoods
from .images import HeadCamera, HeadElectrons, Numbers
from .lamps import Lamps
from .scenes import PHANTOM_SHARE, SHUFFLED, Scenes, orders_of_lenses, states_of


@dataclass(frozen=True)
class _Cases:
    """All states of a head, one by one.

    `table`: type of the lit lens or -1, signal, order, phantom, place; `candelas`, `share`: intensity, cd, and
    probability within the state.
    """

    table: Int[IndexArray, "cases 5"]
    candelas: Float[Array, " cases"]
    share: Float[Array, " cases"]


def _cases(camera: HeadCamera, lamps: Lamps, order: str, sunny: bool) -> _Cases:
    intensities, n_places = camera.vision.intensities_cd, camera.n_places()
    orders = range(len(orders_of_lenses(len(lamps.of_lens))) if order == SHUFFLED else 1)
    rest = np.array([(o, sun, at) for o in orders for sun in range(1 + sunny) for at in range(n_places)])
    sun_share = np.where(rest[:, 1] == 1, PHANTOM_SHARE, 1 - PHANTOM_SHARE) if sunny else np.ones(len(rest))
    lit = [(-1, -1, 0.0, 1.0)]
    for kind, lamp_indices in enumerate(lamps.of_lens):
        share = 1 / (len(lamp_indices) * len(intensities))
        lit += [(kind, int(lamp), candelas, share) for lamp in lamp_indices for candelas in intensities]
    lit_cases = np.array(lit)
    first, second = np.repeat(np.arange(len(lit)), len(rest)), np.tile(np.arange(len(rest)), len(lit))
    table = np.concatenate([lit_cases[first, :2].astype(np.intp), rest[second]], axis=1)
    weight = lit_cases[first, 3] * sun_share[second] / (len(orders) * n_places)
    return _Cases(np.ascontiguousarray(table), np.ascontiguousarray(lit_cases[first, 2]), weight)


def posteriors(
    camera: HeadCamera, scenes: Scenes, images: Numbers, lamps: Lamps, order: str
) -> Float[Array, "images states"]:
    """Return the probability of each state given each image; all states are equally frequent."""
    probabilities = np.empty((len(scenes), len(states_of(camera.vision))))
    groups = np.stack([scenes.distance, scenes.level, scenes.background], axis=1)
    for distance, level in np.unique(groups[:, :2], axis=0):
        heads = camera.electrons(int(distance), int(level))
        cases = _cases(camera, lamps, order, camera.levels[level].phantom_cd > 0)
        for background in np.unique(groups[(groups[:, 0] == distance) & (groups[:, 1] == level), 2]):
            here = np.flatnonzero((groups == (distance, level, background)).all(axis=1))
            probabilities[here] = _of_states(camera, images[here].reshape(len(here), -1), heads, int(background), cases)
    return probabilities


def _of_states(
    camera: HeadCamera, images: Numbers, heads: HeadElectrons, background: int, cases: _Cases
) -> Float[Array, "images states"]:
    """Return the probability of each state before a background."""
    n_cases, unlit = len(cases.table), heads.unlit[:, background]
    telling = np.argsort(-_telling(heads, unlit), kind="stable")
    dark, sun, lamp = (np.ascontiguousarray(part[..., telling]) for part in (unlit, heads.phantoms, heads.lamps))
    node = np.empty((n_cases, telling.size), dtype=np.int32)
    share = np.empty(node.shape, dtype=np.float32)
    light, table = cases.candelas * heads.time_s, camera.table
    orders = orders_of_lenses(len(camera.vision.lenses))
    nodes = table.nodes_e, table.node_of_root, ROOT_STEP
    cases_on_table(dark, sun, lamp, cases.table, light, orders, *nodes, node, share)
    likelihood = np.empty((len(images), n_cases))
    log_likelihoods(np.ascontiguousarray(images[:, telling]), node, share, table.shares, likelihood)
    weights = np.exp(likelihood - likelihood.max(axis=1, keepdims=True)) * cases.share
    is_state = cases.table[:, 0] + 1 == np.arange(1 + len(camera.vision.lenses))[:, None]
    probabilities = weights @ is_state.T.astype(float)
    return np.asarray(probabilities / probabilities.sum(axis=1, keepdims=True), dtype=float)


def _telling(heads: HeadElectrons, unlit: Float[Array, "designs channels"]) -> Float[Array, " channels"]:
    """Return the approximate information of each pixel: effect of a mean lamp over its noise."""
    return np.asarray(heads.lamps.mean(axis=(0, 1, 2)) / np.sqrt(unlit.mean(axis=0) + 1), dtype=float)
