"""A plain image signal processor: white balance, color matrix and gamma, for pictures of 8 bits."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...base.types import Array, Float
from ...spectra.color import XYZ_TO_RGB, srgb_gamma, tristimulus
from ...spectra.spectrum import WavelengthGrid
from .keys import Illuminant
from .materials import ambient_light, chart_reflectances

_DISPLAY: Illuminant = "daylight"
"""D65, the white of sRGB."""


class Isp(NamedTuple):
    """White balance and color matrix: the channels of white, as shares of the largest, and the matrix after balance."""

    white: Float[Array, " channels"]
    matrix: Float[Array, "3 channels"]

    def developed(self, share: Float[Array, "... channels"]) -> NDArray[np.uint8]:
        """Return pictures of demosaicked images: channels are balanced and cut at white, so that what clips is white.

        `share`: channels above the black level, as share of full scale.
        """
        balanced = np.minimum(share / self.white, 1.0)
        return np.asarray(np.rint(255 * srgb_gamma(np.clip(balanced @ self.matrix.T, 0.0, 1.0))), dtype=np.uint8)


def isp_of(grid: WavelengthGrid, qe: Float[Array, "channels wavelengths"], light: Illuminant) -> Isp:
    """Return a camera's ISP under a light: a color matrix by least squares over the ColorChecker, white to white.

    The target of a patch is its linear sRGB under D65. White is the light on a surface of reflectance 1; its brightest
    channel is taken as full scale.
    """
    chart = chart_reflectances(grid)
    ambient = ambient_light(grid, light) * grid.bins_nm
    response, white = chart * ambient @ qe.T, ambient @ qe.T
    response, white = response / white, white / white.max()
    day = ambient_light(grid, _DISPLAY)
    xyz = tristimulus(grid, chart * day) / tristimulus(grid, day[None])[0, 1]
    target = xyz @ XYZ_TO_RGB.T
    matrix = np.linalg.lstsq(response, target, rcond=None)[0].T
    return Isp(white, np.asarray(matrix / matrix.sum(axis=1, keepdims=True), dtype=float))
