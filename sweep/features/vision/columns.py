"""Error of the ideal observer of images of signal heads, the least of any reader of these images on average."""

from __future__ import annotations

import numpy as np

from ...base.types import ChannelCurves
from ...camera.setup import Setup
from ...metrics.batch import Batch
from ...metrics.metric import Metric
from ...metrics.quantity import Columns, Quantity, RequestedQuantities
from ...metrics.smooth import Rows, SmoothDesign
from .keys import SeededVision

VISION_ERROR = "vision_error"
EXAMPLE = True


class ImageReading(Metric):
    """Ideal observer over the images of the benchmark's first seed, with the lenses in any order."""

    order = 8
    needs = "vision"

    def quantities(self, requested: RequestedQuantities) -> tuple[Quantity, ...]:
        meaning = (
            "expected share of images of signal heads that the ideal observer reads wrongly, where a study has "
            "`vision`: over all its distances and levels, the lenses in any order, unseen lamps of the first seed"
        )
        error = Quantity(
            VISION_ERROR,
            VISION_ERROR,
            meaning,
            direction="less",
            goal=True,
            nominal=True,
            smooth=_rows,
            slopes=False,
        )
        return (error,) if requested.asked("vision") else ()

    def of_batch(self, batch: Batch) -> Columns:
        """Compute the mean over the images of one less the probability of the most probable state."""
        errors = [_error(batch.setup, curves) for curves in batch.curves]
        return {VISION_ERROR: np.array(errors)}


def _error(setup: Setup, curves: ChannelCurves) -> float:
    from .readers import observer_error

    images = setup.features["vision"]
    assert isinstance(images, SeededVision)
    return observer_error(setup, curves, images.vision, (images.seed, 0))


def _rows(design: SmoothDesign) -> Rows:
    """Return its value, for the same scenes and random numbers of all designs."""
    error = np.array([_error(design.setup, design.curves)])
    return Rows(error, np.zeros((1, len(design.by_u))))
