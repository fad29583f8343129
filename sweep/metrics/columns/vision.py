"""Error of the ideal observer of images of signal heads, the least of any reader of these images on average."""

from __future__ import annotations

import numpy as np

from ...base.types import DesignCurves
from ...camera.setup import Setup
from ...vision.section import Vision
from ..metric import VisionMetric
from ..quantity import Columns, Quantity, RequestedQuantities
from ..smooth import Rows, SmoothDesign

VISION_ERROR = "vision_error"


class ImageReading(VisionMetric):
    """Ideal observer over the images of the benchmark's first seed, with the lenses in any order."""

    order = 8

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
            ends=("max",),
            goal=True,
            nominal=True,
            smooth=_rows,
            slopes=False,
        )
        return (error,) if requested.vision else ()

    def of_images(self, setup: Setup, curves: DesignCurves, vision: Vision, seed: int) -> Columns:
        """Compute the mean over the images of one less the probability of the most probable state."""
        from ...vision.readers import observer_error  # noqa: PLC0415  (only where a study asks for images)

        return {VISION_ERROR: np.array([observer_error(setup, curve, vision, (seed, 0)) for curve in curves])}


def _rows(design: SmoothDesign) -> Rows:
    """Return its value, for the same scenes and random numbers of all designs."""
    assert design.images is not None
    error = ImageReading().of_images(design.setup, design.curves[None], *design.images)[VISION_ERROR]
    return Rows(error, np.zeros((1, len(design.by_u))))
