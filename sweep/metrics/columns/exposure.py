"""Exposure: how long a scene is exposed for a design."""

from __future__ import annotations

from ..quantity import Asked, Metric, Quantity

EXPOSURE = "exposure_s"


class Exposure(Metric):
    """What the readout of every scene gives by itself."""

    order = 3

    def quantities(self, asked: Asked) -> tuple[Quantity, ...]:
        return (Quantity(EXPOSURE, EXPOSURE, "exposure time, the same for all channels", unit="s", digits=6),)
