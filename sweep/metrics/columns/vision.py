"""Error of the ideal observer of images of signal heads, the least of any reader of these images on average."""

from __future__ import annotations

import numpy as np

from ...base.types import ChannelCurves
from ...camera.setup import Setup
from ...vision.section import SeededVision
from ..batch import Batch
from ..metric import Metric
from ..quantity import Columns, Quantity, RequestedQuantities
from ..smooth import Rows, SmoothDesign

VISION_ERROR = "vision_error"


class ImageReading(Metric):
    """Ideal observer over the images of the benchmark's first seed, with the lenses in any order."""

    order = 8
    needs = "images"

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
        return (error,) if requested.vision else ()

    def of_batch(self, batch: Batch) -> Columns:
        """Compute the mean over the images of one less the probability of the most probable state."""
        assert batch.images is not None
        errors = [_error(batch.setup, curves, batch.images) for curves in batch.curves]
        return {VISION_ERROR: np.array(errors)}


def _error(setup: Setup, curves: ChannelCurves, images: SeededVision) -> float:
    from ...vision.readers import observer_error  # noqa: PLC0415  (only where a study asks for images)

    vision, seed = images
    return observer_error(setup, curves, vision, (seed, 0))


def _rows(design: SmoothDesign) -> Rows:
    """Return its value, for the same scenes and random numbers of all designs."""
    assert design.images is not None
    error = np.array([_error(design.setup, design.curves, design.images)])
    return Rows(error, np.zeros((1, len(design.by_u))))
