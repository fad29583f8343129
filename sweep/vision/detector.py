"""The simplest detector: the brightest places of an image, and their color by linear discriminant analysis.

A place is a local maximum of the image above the median around it, in units of the noise. Its color is the light of
each pixel of the tile there, as shares of all. Classes are the signal types and everything else; they are Gaussian with
one covariance, as in Fisher's discriminant.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter, median_filter, uniform_filter
from scipy.special import softmax

from ..base.types import Array, BoolArray, Float, IndexArray, Int
from ..camera.mosaic import Mosaic
from ..camera.pixel import Pixel
from .batches import Batch
from .boxes import match_radius_px
from .planes import in_noise, tile_planes

_AROUND, _APART = 7, 5
"""Side of the area of the median, and of that of which a place is the maximum, in tiles."""
_LEAST = 8.0
"""A place is above the median by so many times the noise of a tile's mean."""
_OTHER = "other"
_RIDGE = 1e-4


class Detector:
    """Detector of lit lenses of one design."""

    def __init__(self, mosaic: Mosaic, pixel: Pixel, lenses: Sequence[str]) -> None:
        self.mosaic = mosaic
        self.pixel = pixel
        self.classes = (*lenses, _OTHER)

    def _places(
        self, images: NDArray[np.generic]
    ) -> tuple[Int[IndexArray, " places"], Float[Array, "places 2"], Float[Array, "places _"]]:
        """Return image and position of each place, (x, y) in pixels, and its features."""
        rows, columns = self.mosaic.indices.shape
        planes = tile_planes(in_noise(images, self.pixel), self.mosaic)
        above = planes - median_filter(planes, size=(1, _AROUND, _AROUND, 1), mode="nearest")
        bright = uniform_filter(above.mean(axis=3), size=(0, 3, 3), mode="nearest")
        noise = 1 / np.sqrt(9 * planes.shape[3])
        peaks = (bright == maximum_filter(bright, size=(1, _APART, _APART))) & (bright > _LEAST * noise)
        number, row, column = np.nonzero(peaks)
        near = [
            np.clip(at[:, None] + np.arange(-1, 2), 0, n - 1)
            for at, n in zip((row, column), bright.shape[1:], strict=True)
        ]
        window = np.maximum(above[number[:, None, None], near[0][:, :, None], near[1][:, None, :]], 0.0)
        light = window.sum(axis=3)
        total = np.maximum(light.sum(axis=(1, 2)), 1e-12)
        x = (light * near[1][:, None, :]).sum(axis=(1, 2)) / total * columns + (columns - 1) / 2
        y = (light * near[0][:, :, None]).sum(axis=(1, 2)) / total * rows + (rows - 1) / 2
        shares = window.sum(axis=(1, 2)) / total[:, None]
        return number, np.stack([x, y], axis=1), np.column_stack([shares, np.log(total)])

    def learn(self, batches: Iterable[Batch]) -> None:
        """Learn the colors of the places of training images."""
        features, classes = [], []
        for images, labels in batches:
            number, at_px, colors = self._places(images)
            features.append(colors)
            classes.append(self._classes_at(number, at_px, labels))
        x, y = np.concatenate(features), np.concatenate(classes)
        counts = np.bincount(y, minlength=len(self.classes))
        means = np.stack([x[y == k].mean(axis=0) if counts[k] else x.mean(axis=0) for k in range(len(counts))])
        within = (x - means[y]).T @ (x - means[y]) / max(len(x), 1) + _RIDGE * np.eye(x.shape[1])
        self._weights = np.linalg.solve(within, means.T)
        self._offsets = np.log(np.maximum(counts, 1e-9) / max(len(x), 1)) - 0.5 * (means.T * self._weights).sum(axis=0)

    def _classes_at(
        self, number: Int[IndexArray, " places"], at_px: Float[Array, "places 2"], labels: pd.DataFrame
    ) -> Int[IndexArray, " places"]:
        """Return the class of each place: the signal type of a lit lens within the radius, or other."""
        classes = np.full(len(number), len(self.classes) - 1)
        for i, (image, position) in enumerate(zip(number, at_px, strict=True)):
            row = labels.iloc[int(image)]
            lit = np.stack([row["head_x_px"], row["lit_y_px"]], axis=1)
            away: BoolArray = np.hypot(*(lit - position).T) <= match_radius_px(np.asarray(row["lens_diameter_px"]))
            for head in np.flatnonzero(away)[:1]:
                classes[i] = self.classes.index(row["state"][head])
        return classes

    def detect(self, batches: Iterable[Batch]) -> pd.DataFrame:
        """Return detections: `image_id`, `x_px`, `y_px`, `state`, `score` (0 to 1).

        Returns a row per place whose most probable class is a signal type.
        """
        parts = []
        for images, labels in batches:
            number, at_px, colors = self._places(images)
            shares = softmax(colors @ self._weights + self._offsets, axis=1)
            best = shares[:, :-1].argmax(axis=1)
            part = pd.DataFrame(
                {"image_id": labels["image_id"].to_numpy()[number], "x_px": at_px[:, 0], "y_px": at_px[:, 1]}
            )
            parts.append(part.assign(state=np.array(self.classes)[best], score=shares[np.arange(len(best)), best]))
        return pd.concat(parts, ignore_index=True)
