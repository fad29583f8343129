"""Network as a reader of labeled images, of a run or of exported files: its inputs, training and probabilities.

Like the ideal observer it is given distance, light level, background, and whether the lenses stand in the street's
order; it learns from the images and labels of the training split alone.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import product
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ..base.types import Array, Bool, BoolArray, Float, ImageNumbers, IndexArray, Int
from ..camera.mosaic import Mosaic
from ..camera.pixel import Pixel
from .batches import Batch
from .head import heights
from .network import Network, train
from .planes import demosaicked, in_noise, tile_planes
from .scenes import FIXED, orders_of_lenses, states_of
from .section import Vision

_LEAST_REACH_PX = 6.0
"""Reach of the network from the middle, at least; up to the centers of the outer lenses of the nearest head."""
_SOFT = 10.0
"""Deviations of more than so many times the noise are compressed."""
_SHRINK = 10.0
"""Weight, in images, of the mean of a level and background in that of a distance."""
Float32 = NDArray[np.float32]


@dataclass(frozen=True)
class _Examples:
    """Inputs and labels of images.

    `planes`: in units of the noise; `mirrored` the same of their mirror
    images (empty if the tile has none); `condition`: index of distance, level and background; `fixed`: 1 for lenses in
    the street's order; `targets`: state, lit position,
    order and sun on the lenses.
    """

    planes: Float32
    mirrored: Float32
    condition: Int[IndexArray, " examples"]
    fixed: Int[IndexArray, " examples"]
    targets: Int[IndexArray, "examples 4"]

    def subset(self, which: Int[IndexArray, " which"] | Bool[BoolArray, " which"]) -> _Examples:
        parts = {field.name: getattr(self, field.name) for field in fields(self)}
        return _Examples(**{name: part[which] if len(part) else part for name, part in parts.items()})

    @staticmethod
    def joined(parts: Sequence[_Examples]) -> _Examples:
        names = [field.name for field in fields(_Examples)]
        return _Examples(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in names})


class NetworkReader:
    """Network that reads the images of one design."""

    def __init__(self, vision: Vision, mosaic: Mosaic, pixel: Pixel) -> None:
        self.vision = vision
        self.mosaic = mosaic
        self.pixel = pixel
        self._fitted: _Fitted | None = None
        self._kinds = [tuple(vision.lenses[kind] for kind in order) for order in orders_of_lenses(len(vision.lenses))]
        self._conditions = list(product(vision.levels, vision.backgrounds, vision.distances_m))
        rows, columns = mosaic.indices.shape
        extent_px = max(vision.target(distance).object_resolution_px for distance in vision.distances_m)
        reach = max(extent_px * float(heights(vision)[-1]), _LEAST_REACH_PX)
        half = vision.crop_px // 2
        crop = [min(math.ceil(reach / size) * size, half // size * size) for size in (rows, columns)]
        middle = [half // size * size for size in (rows, columns)]
        self._rows, self._columns = (np.arange(at - size, at + size) for at, size in zip(middle, crop, strict=True))
        self._mirror = self._mirrored_columns(middle[1])

    def _mirrored_columns(self, middle: int) -> Int[IndexArray, " planes"] | None:
        """Return the columns of the mirror image that has the same tile, about the image's middle; None without one."""
        tile = self.mosaic.indices
        for shift in range(tile.shape[1]):
            if (tile[:, (shift - np.arange(tile.shape[1])) % tile.shape[1]] == tile).all():
                columns = 2 * middle + shift - self._columns
                return np.where(columns < self.vision.crop_px, columns, columns - tile.shape[1])
        return None

    def planes(self, images: NDArray[np.generic], *, mirrored: bool = False) -> Float32:
        """Return the middle of images in units of their noise, as planes.

        `images`: raw images, DN; `mirrored`: True for mirror images. Returns a plane for each pixel of the tile, or
        each channel at every pixel, as the study asks.
        """
        columns = self._mirror if mirrored else self._columns
        scaled = in_noise(images[:, self._rows[:, None], columns], self.pixel)
        is_demosaicked = self.vision.input == "demosaicked"
        planes = demosaicked(scaled, self.mosaic) if is_demosaicked else tile_planes(scaled, self.mosaic)
        return planes.astype(np.float32)

    def _examples(self, batches: Iterable[Batch]) -> _Examples:
        """Return inputs and targets of labeled images."""
        parts = [
            _Examples(
                self.planes(images),
                np.empty((0,), np.float32) if self._mirror is None else self.planes(images, mirrored=True),
                _codes(zip(labels["level"], labels["background"], labels["distance_m"], strict=True), self._conditions),
                (labels["order"] == FIXED).to_numpy().astype(np.intp),
                self._targets(labels),
            )
            for images, labels in batches
        ]
        return _Examples.joined(parts)

    def _targets(self, labels: pd.DataFrame) -> Int[IndexArray, "images 4"]:
        lit = labels["lit"].astype("Int64").fillna(-1).to_numpy(dtype=np.intp) + 1
        order = _codes(map(tuple, labels["lenses"]), self._kinds)
        state = _codes(labels["state"], states_of(self.vision))
        return np.stack([state, lit, order, labels["phantom"].to_numpy(dtype=np.intp)], axis=1)

    def learn(self, training: Iterable[Batch], check: Iterable[Batch], seed: tuple[int, ...]) -> None:
        """Train the network, and its confidence on other lamps."""
        examples, checked = self._examples(training), self._examples(check)
        # Those that stand in the street's order by chance teach that order, too, beside any.
        by_chance = examples.subset(examples.targets[:, 2] == 0)
        examples = _Examples.joined([examples, replace(by_chance, fixed=np.ones_like(by_chance.fixed))])
        self._fitted = self._fit(examples, seed).calibrated(checked)

    def _fit(self, training: _Examples, seed: tuple[int, ...]) -> _Fitted:
        inputs = _Inputs(training, (-1, len(self.vision.distances_m)), len(self._conditions))
        planes, known, targets = inputs.of(training.planes, training), inputs.known(training), training.targets
        if training.mirrored.size:
            planes = np.concatenate([planes, inputs.of(training.mirrored, training)])
            known, targets = np.tile(known, (2, 1)), np.tile(targets, (2, 1))
        n_lenses = len(self.vision.lenses)
        sizes = (1 + n_lenses, 1 + n_lenses, len(self._kinds), 2)
        return _Fitted(train((planes, known), targets, sizes, self.vision.epochs, seed), inputs, 1.0)

    def read(self, images: Iterable[Batch]) -> Float[Array, "images states"]:
        """Return the probability of each state."""
        assert self._fitted is not None
        return self._fitted.probabilities(self._examples(images))


class _Inputs:
    """Deviations of images from the mean of their distance, level and background in a training set."""

    def __init__(self, training: _Examples, by_distance: tuple[int, int], n_conditions: int) -> None:
        sums, counts = np.zeros((n_conditions, *training.planes.shape[1:])), np.zeros(n_conditions)
        for planes in (training.planes, training.mirrored):
            for condition in np.unique(training.condition) if planes.size else ():
                here = planes[training.condition == condition]
                sums[condition] += here.sum(axis=0, dtype=float)
                counts[condition] += len(here)
        self.means = _shrunk(sums, counts.reshape(-1, *(1,) * (sums.ndim - 1)), by_distance)
        self.deviation = 1.0
        self.deviation = max(float(self.of(training.planes, training).std()), 1e-12)

    def of(self, planes: Float32, examples: _Examples) -> Float32:
        """Return deviations from the means, large ones compressed."""
        scaled = np.arcsinh((planes - self.means[examples.condition].astype(np.float32)) / np.float32(_SOFT))
        return np.asarray(scaled / np.float32(self.deviation), dtype=np.float32)

    def known(self, examples: _Examples) -> Float32:
        """Return condition and order as zeros and ones."""
        condition = np.eye(len(self.means), dtype=np.float32)[examples.condition]
        return np.column_stack([condition, examples.fixed.astype(np.float32)])


def _shrunk(
    sums: Float[Array, " conditions *batch"], counts: Float[Array, "conditions ..."], by_distance: tuple[int, int]
) -> Float[Array, " conditions *batch"]:
    """Return the means of conditions, each shrunk to that of all distances."""
    all_sums, all_counts = (part.reshape(*by_distance, *part.shape[1:]) for part in (sums, counts))
    of_all = all_sums.sum(axis=1, keepdims=True) / np.maximum(all_counts.sum(axis=1, keepdims=True), 1)
    means = (all_sums + _SHRINK * of_all) / (all_counts + _SHRINK)
    return np.asarray(means.reshape(sums.shape), dtype=float)


class _Fitted(NamedTuple):
    """Trained network with its inputs, and the temperature by which its logits are divided."""

    network: Network
    inputs: _Inputs
    temperature: float

    def calibrated(self, check: _Examples) -> _Fitted:
        """Return the reader with the temperature of the largest likelihood (Guo et al., ICML 2017)."""
        from scipy.optimize import minimize_scalar  # noqa: PLC0415  (slow to import)
        from scipy.special import log_softmax  # noqa: PLC0415

        logits, states = self._logits(check), check.targets[:, 0]

        def loss(log_temperature: float) -> float:
            log_shares = log_softmax(logits / math.exp(log_temperature), axis=1)
            return -float(np.take_along_axis(log_shares, states[:, None], axis=1).mean())

        return self._replace(temperature=math.exp(minimize_scalar(loss, bounds=(-2.0, 3.0), method="bounded").x))

    def _logits(self, examples: _Examples) -> Float[Array, "examples states"]:
        return self.network.logits(self.inputs.of(examples.planes, examples), self.inputs.known(examples))

    def probabilities(self, examples: _Examples) -> Float[Array, "examples states"]:
        """Return the probability of each state."""
        from scipy.special import softmax  # noqa: PLC0415  (slow to import)

        return np.asarray(softmax(self._logits(examples) / self.temperature, axis=1), dtype=float)


def _codes(values: Iterable[object], known: Iterable[object]) -> ImageNumbers:
    """Return the index of each value in a list."""
    index: Mapping[object, int] = {value: at for at, value in enumerate(known)}
    return np.array([index[value] for value in values], dtype=np.intp)
