"""A plain image signal processor: white balance, color matrix and gamma, for pictures of 8 bits."""

from __future__ import annotations

import numpy as np

from ..base.types import FloatArray
from ..spectra.color import XYZ_TO_RGB, color_matching, srgb_gamma
from ..spectra.spectrum import WavelengthGrid, energy_from_photons
from .materials import ambient_light, chart_reflectances
from .section import Illuminant

_DISPLAY: Illuminant = "daylight"
"""D65, the white of sRGB."""


def isp_matrix(grid: WavelengthGrid, qe: FloatArray, light: Illuminant) -> FloatArray:
    """Return the color matrix of a camera under a light: least squares over the ColorChecker, white to white.

    The target of a patch is its linear sRGB under D65, so that the matrix balances white, too. White is the light on a
    surface of reflectance 1; its brightest channel is taken as full scale.

    Parameters
    ----------
    grid : WavelengthGrid
        Wavelengths, nm.
    qe : ndarray of shape (n_channels, n_wavelengths)
        QE of the channels.
    light : str
        Ambient light.

    Returns
    -------
    ndarray of shape (3, n_channels)
        Linear sRGB per share of full scale.
    """
    chart = chart_reflectances(grid)
    response = chart * ambient_light(grid, light) @ qe.T
    white = ambient_light(grid, light) @ qe.T
    response, white = response / white.max(), white / white.max()
    day = energy_from_photons(grid.nodes_nm, ambient_light(grid, _DISPLAY)[None])[0]
    matching = color_matching(grid)
    xyz = chart * day @ matching.T / (day @ matching[1])
    target = xyz @ XYZ_TO_RGB.T
    matrix = np.linalg.lstsq(response, target, rcond=None)[0].T
    balanced: FloatArray = matrix / (matrix @ white)[:, None]
    return balanced


def developed(share: FloatArray, matrix: FloatArray) -> FloatArray:
    """Return pictures of demosaicked images.

    Parameters
    ----------
    share : ndarray of shape (..., n_channels)
        Channels above the black level, as share of full scale.
    matrix : ndarray of shape (3, n_channels)
        Color matrix.

    Returns
    -------
    ndarray of uint8, shape (..., 3)
        sRGB.
    """
    linear = np.clip(share @ matrix.T, 0.0, 1.0)
    return np.asarray(np.rint(255 * srgb_gamma(linear)), dtype=np.uint8)
