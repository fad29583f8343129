"""Exposure time of a scene for each design."""

from __future__ import annotations

from ..metric import Metric
from ..quantity import Quantity, RequestedQuantities

EXPOSURE = "exposure_s"


class Exposure(Metric):
    """Exposure time, part of every readout."""

    order = 3

    def quantities(self, requested: RequestedQuantities) -> tuple[Quantity, ...]:
        return (Quantity(EXPOSURE, EXPOSURE, "exposure time, the same for all channels", unit="s", digits=6),)
