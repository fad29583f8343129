"""Networks as a reader of crops: their inputs, and training by gradients on new images in every step."""

from __future__ import annotations

import numpy as np

from ..base.types import Array, Bool, BoolArray, Float, ImageNumbers
from .crops import Crops, Float32, Seen
from .network import STEPS, Examples, logits, train

_SOFT = 10.0
"""Deviations of more than so many times the noise are compressed."""
_FOR_MEANS = 1000
_FIXED_SHARE = 0.25
"""Share of the training images whose lenses stand in the street's order, and of which it is said."""
_BATCH = 112
"""Training images of one step and distance."""


class NetworkReader:
    """Networks of one design."""

    def __init__(self, crops: Crops, images: int, seed: tuple[int, ...]) -> None:
        """Learn from a number of images, each seen once."""
        vision = crops.vision
        self._vision, self._crops, n_distances = vision, crops, len(vision.distances_m)
        weights = np.array([level.train_weight for level in vision.levels.values()])
        # Of each level at least one image a step.
        self._batches = np.maximum(np.rint(_BATCH * weights / weights.sum()), 1).astype(np.intp)
        self._means = [[self._mean(at, level) for at in range(n_distances)] for level in range(len(vision.levels))]
        calls = max(1, round(images / (self._batches.sum() * n_distances * STEPS)))
        self._weights = train(self._examples, 1 + len(vision.lenses), calls, seed)

    def _examples(self, steps: int) -> list[Examples]:
        """Return new images of each level."""
        levels = []
        for level, count in enumerate(self._batches):
            parts = []
            for distance in range(len(self._vision.distances_m)):
                heads = self._crops.random(level, steps * int(count))
                fixed = np.arange(heads.kind.size) % round(1 / _FIXED_SHARE) == 0
                heads = heads._replace(order=np.where(fixed, 0, heads.order))
                x = self._inputs(self._crops.draw(distance, level, heads), distance, level)
                known = _known(heads.background, fixed, len(self._vision.backgrounds))
                own = x, known, (heads.kind + 1).astype(np.int32)
                parts.append([part.reshape(steps, int(count), *part.shape[1:]) for part in own])
            levels.append(Examples(*(np.stack(part, axis=1) for part in zip(*parts, strict=True))))
        return levels

    def _mean(self, distance: int, level: int) -> Float32:
        images = self._crops.draw(distance, level, self._crops.random(level, _FOR_MEANS))
        return np.asarray(self._seen(images).mean(axis=0), dtype=np.float32)

    def _seen(self, crops: Float32) -> Float32:
        return self._crops.demosaicked(crops) if self._vision.input == "demosaicked" else crops

    def _inputs(self, crops: Float32, distance: int, level: int) -> Float32:
        """Return deviations from the mean, large ones compressed."""
        deviations = (self._seen(crops) - self._means[level][distance]) / np.float32(_SOFT)
        return np.asarray(np.arcsinh(deviations), dtype=np.float32)

    def log_probabilities(self, seen: Seen) -> Float[Array, "images states"]:
        """Return the logarithm of the probability of each state, but for a constant of each image."""
        logs = np.empty((len(seen.crops), 1 + len(self._vision.lenses)))
        for (distance, level), here in seen.conditions():
            known = _known(seen.background[here], np.full(here.size, seen.fixed), len(self._vision.backgrounds))
            logs[here] = logits(self._weights[level], distance, self._inputs(seen.crops[here], distance, level), known)
        return logs


def _known(background: ImageNumbers, fixed: Bool[BoolArray, " images"], n: int) -> Float32:
    """Return background and order as zeros and ones."""
    return np.column_stack([np.eye(n, dtype=np.float32)[background], fixed.astype(np.float32)])
