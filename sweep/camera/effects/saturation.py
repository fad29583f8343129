"""Saturation in two steps: the full well holds no more electrons, then the ADC ends at its full scale."""

from __future__ import annotations

import numpy as np

from ...base.types import FloatArray
from ..pixel import Pixel
from ..shot import Shot
from .base import Chosen, Load, ReadoutEffect
from .quantization import rounded

CLIPPED_S = 6.5e-10
"""Seconds of clipping a value; `tests/bench_work.py` measures them."""
JUST_ABOVE = 1 + 1e-12
"""Bounds of a value that is rounded leave this room for the arithmetic of both."""


def top_e(pixel: Pixel) -> float:
    """Electrons from which the readout does not rise any more: the full well, or the end of the ADC's range."""
    return min(pixel.well_e, (pixel.full_scale_dn - pixel.offset_dn) / pixel.dn_per_e)


def clipped(electrons: FloatArray, pixel: Pixel) -> FloatArray:
    """Electrons as the readout sees them."""
    return np.minimum(electrons, top_e(pixel))


class Saturation(ReadoutEffect):
    """The bright end of the readout."""

    name = "saturation"
    methods = ("skip", "clip")
    order = 2
    without = "no signal reaches it"
    bends = True

    def exact(self, shot: Shot) -> str | None:
        """Nothing but the brightness decides."""
        return None

    def never_reached(self, shot: Shot, brightest_dn: float, signals_dn: float) -> str | None:
        """Noise may reach it anyway. Rounding ends at the ADC's range, too, but is not counted."""
        below = brightest_dn / shot.pixel.dn_per_e <= top_e(shot.pixel)
        quiet = shot.scenario.noise is None
        return f"the brightest signal has at most {signals_dn:.0f} DN" if below and quiet else None

    def allowed(self, shot: Shot, methods: Chosen) -> bool:
        """Noise moves a mean only where something clips, and rounding clips, too."""
        quiet = shot.scenario.noise is None or methods.noise == "skip"
        return methods.saturation != "skip" or (quiet and methods.quantization == "skip")

    def range_dn(self, shot: Shot, brightest_dn: float, methods: Chosen) -> float:
        """See `ReadoutEffect`: the change of the brightest signal, which grows with it.

        Where the value is rounded afterwards, the change of the rounded one, which the end of the ADC still bounds;
        where noise dithers it, up to a step more.
        """
        pixel = shot.pixel
        brightest_e = brightest_dn / pixel.dn_per_e
        excess = max(0.0, brightest_e - top_e(pixel)) * pixel.dn_per_e
        if excess == 0 or methods.quantization == "skip":
            return excess
        if shot.scenario.noise is not None:
            return excess + 1.0
        held, whole = rounded(np.array([top_e(pixel), brightest_e * JUST_ABOVE]) * pixel.dn_per_e, pixel)
        return float(whole - held)

    def work(self, shot: Shot, methods: Chosen, load: Load) -> Load:
        """Every value is compared with the end of the range."""
        return load if methods.saturation == "skip" else load._replace(value_s=load.value_s + CLIPPED_S)
