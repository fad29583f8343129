"""Exposure time of a scene for each design."""

from __future__ import annotations

from ..quantity import Asked, Metric, Quantity

EXPOSURE = "exposure_s"


class Exposure(Metric):
    """Exposure time, part of every readout."""

    order = 3

    def quantities(self, asked: Asked) -> tuple[Quantity, ...]:
        return (Quantity(EXPOSURE, EXPOSURE, "exposure time, the same for all channels", unit="s", digits=6),)
