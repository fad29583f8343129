"""Mean and variance of the readout by table lookup."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...base.types import Array, Float, IndexArray, Int, SameShape
from ..pixel import Pixel
from . import moments

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

_CUT = 1e-5
_LEAST_PRNU = 1e-9
"""A smaller PRNU spaces nodes as evenly, but for rounding."""


class MomentTable(NamedTuple):
    """Cubics over the root of the expected electrons: several values at once.

    `nodes` are at least `step` apart; `coefficients` are of the pieces between them; `piece` is that at each multiple
    of `step` from 0 up. From `last_e` electrons on values are constant.
    """

    nodes: Float[Array, " nodes"]
    coefficients: Float[Array, "4 nodes-1 3"]
    piece: Int[IndexArray, " pieces"]
    last_e: float
    step: float

    @classmethod
    def of(cls, spline: CubicSpline, last_e: float, step: float) -> MomentTable:
        """Return the table of a spline with the values on axis 1."""
        multiples = step * np.arange(int(spline.x[-1] / step) + 1)
        piece = np.minimum(np.searchsorted(spline.x, multiples, side="right") - 1, spline.x.size - 2)
        return cls(spline.x, np.ascontiguousarray(spline.c.T), piece, last_e, step)

    def look_up(self, electrons: SameShape, row: int) -> SameShape:
        """Return one of the values at some electrons."""
        from .kernels import cubic_of_electrons  # noqa: PLC0415  (compiled: kept off the start-up path)

        values = np.empty(electrons.shape)
        of_row = self.nodes, self.coefficients[row], self.piece, self.step
        flat = np.ascontiguousarray(electrons, dtype=float).ravel()
        cubic_of_electrons(flat, self.last_e, *of_row, values.ravel())
        return values


def mean_unrounded(electrons: SameShape, pixel: Pixel) -> SameShape:
    """Return the mean before rounding, DN."""
    return tables(pixel).look_up(electrons, moments.UNROUNDED)


def mean_rounded(electrons: SameShape, pixel: Pixel) -> SameShape:
    """Return the mean of the digital number, DN."""
    return tables(pixel).look_up(electrons, moments.ROUNDED)


def variance(electrons: SameShape, pixel: Pixel) -> SameShape:
    """Return the variance of the digital number, DN^2."""
    return np.maximum(tables(pixel).look_up(electrons, moments.VARIANCE), 0.0)


@lru_cache(maxsize=64)
def unclipped_e(pixel: Pixel) -> tuple[float, float]:
    """Return the range of electrons in which neither end shifts the mean by more than 1e-5 of the noise.

    (1, 0) if it is empty.
    """
    electrons = tables(pixel).nodes ** 2
    sigma = pixel.dn_per_e * np.sqrt(electrons + (pixel.prnu * electrons) ** 2 + pixel.read_noise_e**2)
    shift = mean_unrounded(electrons, pixel) - pixel.dn_per_e * electrons - pixel.offset_dn
    unclipped = electrons[np.abs(shift) <= _CUT * sigma + 1e-9]
    return (float(unclipped[0]), float(unclipped[-1])) if unclipped.size else (1.0, 0.0)


@lru_cache(maxsize=8)
def tables(pixel: Pixel) -> MomentTable:
    """Return the table of a pixel.

    With PRNU the noise grows faster than the root of the electrons. Nodes are then equidistant in asinh(PRNU root) /
    PRNU, twice the standard deviation.
    """
    from scipy.interpolate import CubicSpline  # noqa: PLC0415  (slow to import: kept off the start-up path)

    if pixel.prnu:
        prnu = max(pixel.prnu, _LEAST_PRNU)
        last = np.arcsinh(prnu * np.sqrt(moments.LinearRange.of(pixel).last_e)) / prnu
        nodes = np.sinh(prnu * np.arange(0, last + 2 * moments.STEP, moments.STEP)) / prnu
        spline = CubicSpline(nodes, moments.moments(nodes**2, pixel), axis=1)
    else:
        spline = moments.table_without_prnu(pixel)
    return MomentTable.of(spline, moments.LinearRange.of(pixel).last_e, moments.STEP)
