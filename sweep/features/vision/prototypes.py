"""Prototype network: a matched filter for each hidden class of a head, and the sum of the likelihoods of a state.

A class is all that is random but the lamp: place, sun, order of the lenses, which is lit and where, its intensity. Its
prototype is the mean of its training images in units of the noise, where the noise is 1. Lamps of one class differ in
how bright the light of a lamp is in each channel, by a covariance that is learned, too. Priors are those of the scenes;
nothing descends.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import NamedTuple

import numpy as np

from ...base.types import Array, Float, ImageNumbers, IndexArray
from .crops import Crops, Float32, Heads, Seen
from .scenes import PHANTOM_SHARE, orders_of_lenses

_VALUES_AT_ONCE = 3_000_000
_READ_AT_ONCE = 256
_SPREAD = 0.1
"""Share of the images by which the spread along lamps is learned."""
_PRIOR_IMAGES = 5.0
"""Weight, in images, of no spread."""


class _Classes(NamedTuple):
    """Hidden classes of a light level before one background.

    `dark`: class of the same head without the lamp; `group`: classes that differ in the place alone; `share`:
    probability with the lenses in any order, and in the street's.
    """

    heads: Heads
    dark: ImageNumbers
    group: ImageNumbers
    share: Float[Array, "2 classes"]


def _classes(crops: Crops, level: int) -> _Classes:
    """Return the hidden classes; without sun an order counts by where the lit lens is."""
    vision = crops.vision
    orders, n_kinds = orders_of_lenses(len(vision.lenses)), len(vision.lenses)
    rows: dict[tuple[int, ...], int] = {}
    shares: list[list[float]] = []
    of_sun = (1 - PHANTOM_SHARE, PHANTOM_SHARE) if crops.sunny[level] else (1.0,)
    cases = product(enumerate(of_sun), range(len(orders)), range(-1, n_kinds), range(len(vision.intensities_cd)))
    for (sunny, share), order, kind, intensity in cases:
        position = -1 if kind < 0 else int(np.flatnonzero(orders[order] == kind)[0])
        key = (sunny, order if sunny else -1, kind, position, intensity if kind >= 0 else 0)
        at = rows.setdefault(key, len(shares))
        if at == len(shares):
            shares.append([0.0, 0.0, order])
        part = share / ((1 + n_kinds) * len(vision.intensities_cd))
        shares[at][0] += part / len(orders)
        shares[at][1] += part * (order == 0)
    table, known, n = np.array(list(rows)), np.array(shares), crops.n_places
    dark = [rows[sunny, order, -1, -1, 0] for sunny, order, *_ in rows]
    place = np.tile(np.arange(n), len(table))
    of_class = table[:, 2], table[:, 4], known[:, 2].astype(np.intp), table[:, 0]
    kinds, intensities, of_order, with_sun = (np.repeat(part, n) for part in of_class)
    heads = Heads(kinds, intensities, of_order, with_sun, place, np.zeros_like(place))
    group = np.repeat(np.arange(len(table)), n)
    return _Classes(heads, np.repeat(dark, n) * n + place, group, np.repeat(known[:, :2].T, n, axis=1) / n)


class _Learned(NamedTuple):
    """Prototypes of the classes of one distance, level and background.

    `directions`: light of a lamp in each channel, normalized; `spread`: covariance along them, noise included.
    """

    classes: _Classes
    means: Float32
    counts: Float[Array, " classes"]
    directions: Float32
    spread: Float[Array, "classes channels channels"]


class Prototypes:
    """Prototypes of one design."""

    def __init__(self, crops: Crops, images: int) -> None:
        """Learn from a number of images, as many of each class as it is frequent."""
        vision = crops.vision
        self._learned: dict[tuple[int, int, int], _Learned] = {}
        self._states = 1 + len(vision.lenses)
        weights = np.array([level.train_weight for level in vision.levels.values()])
        shares = weights / weights.sum() / (len(vision.distances_m) * len(vision.backgrounds))
        for level, share in enumerate(shares):
            classes = _classes(crops, level)
            for distance, background in product(range(len(vision.distances_m)), range(len(vision.backgrounds))):
                learned = _learned(crops, distance, level, background, classes, images * share)
                self._learned[distance, level, background] = learned

    def log_probabilities(self, seen: Seen) -> Float[Array, "images states"]:
        """Return the logarithm of the probability of each state, but for a constant of each image."""
        logs = np.empty((len(seen.crops), self._states))
        for (distance, level), where in seen.conditions():
            for background in np.unique(seen.background[where]):
                own, learned = (
                    where[seen.background[where] == background],
                    self._learned[distance, level, int(background)],
                )
                for here in np.split(own, np.arange(_READ_AT_ONCE, own.size, _READ_AT_ONCE)):
                    logs[here] = _log_probabilities(learned, seen.crops[here], seen.fixed, self._states)
        return logs


def _learned(crops: Crops, distance: int, level: int, background: int, classes: _Classes, images: float) -> _Learned:
    heads = classes.heads._replace(background=np.full_like(classes.heads.background, background))

    def drawn(counts: IndexArray) -> Iterator[tuple[ImageNumbers, Float32]]:
        """Yield some classes and new images of each, in their order."""
        block = np.cumsum(counts) // max(1, _VALUES_AT_ONCE // crops.channels.size)
        for own in np.split(np.arange(counts.size), np.flatnonzero(np.diff(block)) + 1):
            yield own, crops.draw(distance, level, Heads(*(np.repeat(part[own], counts[own]) for part in heads)))

    def summed(values: Float32, counts: IndexArray) -> Float32:
        return np.asarray(np.add.reduceat(values, np.cumsum(counts) - counts, axis=0))

    counts, others = (
        np.maximum(np.rint(images * part * classes.share[0]), 1).astype(np.intp) for part in (1 - _SPREAD, _SPREAD)
    )
    sums = np.concatenate([summed(z, counts[own]) for own, z in drawn(counts)])
    means = sums / counts[:, None].astype(np.float32)
    in_channel = crops.channels == np.arange(1 + crops.channels.max())[:, None]
    directions = (means - means[classes.dark])[:, None] * in_channel.astype(np.float32)
    directions /= np.maximum(np.linalg.norm(directions, axis=2, keepdims=True), 1e-12)
    squares = []
    for own, z in drawn(others):
        mean, direction = (np.repeat(part[own], others[own], axis=0) for part in (means, directions))
        along = np.einsum("ij,icj->ic", z - mean, direction)
        squares.append(summed(along[:, :, None] * along[:, None], others[own]))
    of_group, n = np.zeros((classes.group[-1] + 1, *squares[0].shape[1:])), np.bincount(classes.group, others)
    np.add.at(of_group, classes.group, np.concatenate(squares))
    of_group += _PRIOR_IMAGES * np.eye(len(in_channel))
    values, vectors = np.linalg.eigh(of_group / (n + _PRIOR_IMAGES)[:, None, None])
    spread = (vectors * np.maximum(values, 1.0)[:, None]) @ vectors.transpose(0, 2, 1)
    return _Learned(classes, means, counts.astype(float), directions, spread[classes.group])


def _log_probabilities(learned: _Learned, crops: Float32, fixed: bool, n_states: int) -> Float[Array, "images states"]:
    from scipy.special import logsumexp  # noqa: PLC0415  (slow to import)

    classes, counts = learned.classes, learned.counts
    known = classes.share[int(fixed)] > 0
    means, directions, kind = learned.means[known], learned.directions[known], classes.heads.kind[known]
    reference, n_channels = means.mean(axis=0), directions.shape[1]
    x, m = (crops - reference).astype(float), (means - reference).astype(float)
    # A mean of n images scatters by 1/n.
    v, of_mean = 1 + 1 / counts[known], np.eye(n_channels) / counts[known, None, None]
    inverse = np.linalg.inv(learned.spread[known] + of_mean)
    apart = (x**2).sum(axis=1)[:, None] - 2 * x @ m.T + (m**2).sum(axis=1)
    along = np.stack([x @ own.T - (m * own).sum(axis=1) for own in directions.transpose(1, 0, 2)])
    logs = -0.5 * (
        (apart - (along**2).sum(axis=0)) / v + np.einsum("cij,jcd,dij->ij", along, inverse, along, optimize=True)
    )
    logs += 0.5 * (np.linalg.slogdet(inverse)[1] - (x.shape[1] - n_channels) * np.log(v))
    logs += np.log(classes.share[int(fixed)][known])
    return np.stack([logsumexp(logs[:, kind == state - 1], axis=1) for state in range(n_states)], axis=1)
