"""Compiled inner loop of the light of pixels. It releases the GIL."""

from __future__ import annotations

import numpy as np

from ..base.machine_code import njit
from ..base.types import FloatArray, IndexArray


@njit(cache=True, nogil=True)
def gather(light: FloatArray, shares: FloatArray, place: IndexArray, through: IndexArray, out: FloatArray) -> None:
    """Add the light of pixels in place, pixel by pixel.

    `light`: light behind each channel's filter at each place; `shares`: weight of each part of a pixel; `through`: row
    of `light`, or -1 for a channel that does not count; `out`: array that is changed.
    """
    n_signals = out.shape[2]
    pixel_light = np.empty(n_signals)
    for design in range(out.shape[0]):
        for case in range(out.shape[1]):
            for unit in range(out.shape[3]):
                pixel_light[:] = 0.0
                lit = False
                for part in range(shares.size):
                    channel = through[part, unit]
                    if channel >= 0:
                        lit = True
                        share, part_light = shares[part], light[design, channel, place[part, case, unit]]
                        for s in range(n_signals):
                            pixel_light[s] += share * part_light[s]
                if lit:
                    for s in range(n_signals):
                        out[design, case, s, unit] += pixel_light[s]
