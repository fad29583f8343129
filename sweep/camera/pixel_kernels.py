"""Compiled inner loops of pixels: their light, exposure and readout in whole numbers. They release the GIL."""

from __future__ import annotations

import math

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


@njit(cache=True, nogil=True)
def expose(rates: FloatArray, fixed: FloatArray, uniform: FloatArray, time_s: float) -> None:
    """Replace `rates` by (rates + fixed + uniform) time_s.

    `rates`: electrons/s; changed in place; `fixed`: electrons/s of fixed channels; `uniform`: electrons/s of background
    and dark current.
    """
    for d in range(rates.shape[0]):
        for case in range(rates.shape[1]):
            for s in range(rates.shape[2]):
                rates[d, case, s] = ((fixed[case, s] + rates[d, case, s]) + uniform[d, case]) * time_s


@njit(cache=True, nogil=True)
def whole_numbers(
    electrons: FloatArray, top_e: float, dn_per_e: float, offset_dn: float, full_scale_dn: float, out: FloatArray
) -> None:
    """Convert electrons to whole digital numbers; NaN stays NaN.

    `dn_per_e`, `offset_dn`, `full_scale_dn`: gain, pedestal and full scale, DN; `out`: digital numbers, DN.
    """
    whole_dn = math.floor(offset_dn)
    rest = offset_dn - whole_dn
    for i in range(electrons.size):
        held = electrons[i]
        held = top_e if held > top_e else held
        steps = np.floor((held * dn_per_e + rest) + 0.5) + whole_dn
        steps = 0.0 if steps < 0.0 else steps
        out[i] = full_scale_dn if steps > full_scale_dn else steps
