"""Mean and variance of the readout from a table: every pixel of every design is looked up, not summed."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from ...base.types import FloatArray
from ..pixel import Pixel
from . import moments

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

_CUT = 1e-5
_DENSE = 1 / 64
"""Distance of the nodes where gains differ, in standard deviations of the electrons times two."""


def mean_unrounded(electrons: FloatArray, pixel: Pixel) -> FloatArray:
    """Mean before rounding, DN, of expected electrons of any shape."""
    return _looked_up(electrons, pixel, moments.UNROUNDED)


def mean_rounded(electrons: FloatArray, pixel: Pixel) -> FloatArray:
    """Mean of the digital number, DN."""
    return _looked_up(electrons, pixel, moments.ROUNDED)


def variance(electrons: FloatArray, pixel: Pixel) -> FloatArray:
    """Variance of the digital number, DN^2."""
    return np.maximum(_looked_up(electrons, pixel, moments.VARIANCE), 0.0)


@lru_cache(maxsize=64)
def unclipped_e(pixel: Pixel) -> tuple[float, float]:
    """From and up to how many electrons neither end takes more from the mean than 1e-5 of the noise."""
    table = tables(pixel)[moments.UNROUNDED]
    electrons = (np.sinh(pixel.prnu * table.x) / pixel.prnu if pixel.prnu else table.x) ** 2
    sigma = pixel.dn_per_e * np.sqrt(electrons + (pixel.prnu * electrons) ** 2 + pixel.read_noise_e**2)
    inside = np.abs(table(table.x) - pixel.dn_per_e * electrons - pixel.offset_dn) <= _CUT * sigma + 1e-9
    kept = electrons[inside]
    return (float(kept[0]), float(kept[-1])) if kept.size else (1.0, 0.0)


def _looked_up(electrons: FloatArray, pixel: Pixel, row: int) -> FloatArray:
    table = tables(pixel)[row]
    root = np.sqrt(np.minimum(electrons, moments.Ends.of(pixel).last_e))
    at = np.arcsinh(pixel.prnu * root) / pixel.prnu if pixel.prnu else root
    return np.asarray(table(at), dtype=float)


@lru_cache(maxsize=8)
def tables(pixel: Pixel) -> tuple[PPoly, ...]:
    """A cubic for each of `moments.moments` over twice the standard deviations of the electrons from 0 up.

    That is the root of the electrons, or with PRNU the inverse hyperbolic sine of PRNU times the root, over PRNU.
    """
    from scipy.interpolate import CubicSpline, PPoly  # noqa: PLC0415  (slow to import: kept off the start-up path)

    if pixel.prnu:
        last = np.arcsinh(pixel.prnu * np.sqrt(moments.Ends.of(pixel).last_e)) / pixel.prnu
        nodes = np.arange(0, last + 2 * _DENSE, _DENSE)
        whole = CubicSpline(nodes, moments.moments((np.sinh(pixel.prnu * nodes) / pixel.prnu) ** 2, pixel), axis=1)
    else:
        whole = moments.table_without_prnu(pixel)
    return tuple(PPoly(np.ascontiguousarray(whole.c[..., row]), whole.x) for row in range(3))
