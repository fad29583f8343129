"""Rounding of an ADC."""

from __future__ import annotations

import math

import numpy as np

from ...base.types import SameShape
from ..pixel import Pixel


def rounded(dn: SameShape, pixel: Pixel) -> SameShape:
    """Add the pedestal, round half up, and clip to the range of the ADC.

    The whole part of the pedestal is added after rounding, so that values with and without a whole pedestal differ by
    exactly that.

    `dn`: without pedestal, DN.
    """
    whole_dn = math.floor(pixel.offset_dn)
    steps = np.asarray(dn + (pixel.offset_dn - whole_dn), dtype=float)
    steps += 0.5
    np.floor(steps, out=steps)
    steps += whole_dn
    return np.clip(steps, 0.0, pixel.full_scale_dn, out=steps)
