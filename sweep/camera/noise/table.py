"""Mean and variance of the readout from a table: every pixel of every design is looked up, not summed."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ...base.types import FloatArray, IndexArray
from ..pixel import Pixel
from . import moments

_CUT = 1e-5
_LEAST_PRNU = 1e-9
"""A smaller PRNU spaces nodes as evenly, but for rounding."""


class MomentTable(NamedTuple):
    """Cubics over the root of the expected electrons.

    `nodes`: ndarray[n + 1], at least `moments.STEP` apart; `coefficients`: ndarray[3, n, 4], for each of
    `moments.moments`; `piece`: ndarray of the piece at each multiple of `moments.STEP` from 0 up.
    """

    nodes: FloatArray
    coefficients: FloatArray
    piece: IndexArray


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
    electrons = tables(pixel).nodes ** 2
    sigma = pixel.dn_per_e * np.sqrt(electrons + (pixel.prnu * electrons) ** 2 + pixel.read_noise_e**2)
    off = mean_unrounded(electrons, pixel) - pixel.dn_per_e * electrons - pixel.offset_dn
    kept = electrons[np.abs(off) <= _CUT * sigma + 1e-9]
    return (float(kept[0]), float(kept[-1])) if kept.size else (1.0, 0.0)


def _looked_up(electrons: FloatArray, pixel: Pixel, row: int) -> FloatArray:
    from .compiled import cubic_of_electrons  # noqa: PLC0415  (compiled: kept off the start-up path)

    table, found = tables(pixel), np.empty(electrons.shape)
    of = table.nodes, table.coefficients[row], table.piece
    last_e = moments.Ends.of(pixel).last_e
    cubic_of_electrons(np.ascontiguousarray(electrons, dtype=float).ravel(), last_e, *of, moments.STEP, found.ravel())
    return found


@lru_cache(maxsize=8)
def tables(pixel: Pixel) -> MomentTable:
    """Table of a pixel.

    With PRNU the noise grows faster than the root of the electrons; the nodes lie further apart where it does:
    equidistant in asinh(PRNU root) / PRNU, which is twice the standard deviation.
    """
    from scipy.interpolate import CubicSpline  # noqa: PLC0415  (slow to import: kept off the start-up path)

    if pixel.prnu:
        prnu = max(pixel.prnu, _LEAST_PRNU)
        last = np.arcsinh(prnu * np.sqrt(moments.Ends.of(pixel).last_e)) / prnu
        nodes = np.sinh(prnu * np.arange(0, last + 2 * moments.STEP, moments.STEP)) / prnu
        whole = CubicSpline(nodes, moments.moments(nodes**2, pixel), axis=1)
    else:
        whole = moments.table_without_prnu(pixel)
    multiples = moments.STEP * np.arange(int(whole.x[-1] / moments.STEP) + 1)
    piece = np.minimum(np.searchsorted(whole.x, multiples, side="right") - 1, whole.x.size - 2)
    return MomentTable(whole.x, np.ascontiguousarray(whole.c.T), piece)
