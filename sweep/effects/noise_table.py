"""Mean and variance of the readout from a table: every pixel of every design is looked up, not integrated."""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicSpline

from ..arrays import FloatArray
from ..sensor import Pixel
from . import noise

_MOST_E = 1e30
"""More electrons than this are as many as this."""
_TABLE_NODES = 2048
"""Nodes of each piece of the table of readouts."""
_BEND_SIGMAS = 16.0


def moments(electrons: FloatArray, pixel: Pixel) -> tuple[FloatArray, FloatArray]:
    """`noise.moments_dn` from a table over the square root of the signal, in which both are smooth."""
    electrons = np.minimum(electrons, _MOST_E)
    most = np.nanmax(electrons, initial=1.0)
    brightest = float(2 ** np.ceil(np.log2(most)))
    mean, variance = np.moveaxis(_table(pixel, brightest)(np.sqrt(electrons + pixel.read_noise_e**2)), -1, 0)
    return mean, np.maximum(variance, 0.0)


@lru_cache(maxsize=8)
def _table(pixel: Pixel, brightest_e: float) -> CubicSpline:
    read = pixel.read_noise_e
    roots = _table_roots(pixel, np.sqrt(brightest_e + read**2))
    return CubicSpline(roots, np.stack(noise.moments_dn(np.maximum(roots**2 - read**2, 0.0), pixel), axis=1))


def _table_roots(pixel: Pixel, last: float) -> FloatArray:
    """Nodes from the dark to `last`: dense where the readout bends (in the dark, at full well, at the ADC's end).

    Between these it is straight, and beyond them it hardly changes, however bright the brightest signal is.
    """
    read, ends = pixel.read_noise_e, {pixel.read_noise_e, last}
    for bend_e in (0.0, pixel.well_e, (pixel.full_scale_dn - pixel.offset_dn) / pixel.dn_per_e):
        root = np.sqrt(bend_e + read**2)
        sigma = np.sqrt(noise.variance_e(np.array(bend_e), pixel) + read**2) / (2 * root) if root else 0.5
        ends |= {float(np.clip(root + side * _BEND_SIGMAS * sigma, read, last)) for side in (-1, 0, 1)}
    pieces = [
        np.geomspace(left, right, _TABLE_NODES) if left else np.linspace(left, right, _TABLE_NODES)
        for left, right in pairwise(sorted(ends))
    ]
    return np.unique(np.concatenate(pieces))
