"""CIE 1931 chromaticity of lights, and the color regions of traffic signals."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib import resources

import numpy as np

from ..base.types import FloatArray
from .spectrum import WavelengthGrid, energy_from_photons


@dataclass(frozen=True)
class ColorRegion:
    """A convex region of the chromaticity diagram: a x + b y <= c for every (a, b, c) of `bounds`."""

    bounds: tuple[tuple[float, float, float], ...]
    source: str

    def violation(self, xy: FloatArray) -> FloatArray:
        """How far each point of ndarray[n, 2] is outside, ndarray[n]; inside where <= 0."""
        a, b, c = np.array(self.bounds).T
        return np.asarray((xy[:, :1] * a + xy[:, 1:] * b - c).max(axis=1), dtype=float)


_GRAY = 0.5
_OBSERVER = "cie_1931.csv"
_EN_12368 = "EN 12368 (traffic control equipment, signal heads), color regions of signal lights"
REGIONS = {
    "red": ColorRegion(((0, -1, -0.290), (-1, -1, -0.980), (0, 1, 0.320)), _EN_12368),
    "yellow": ColorRegion(((0, -1, -0.387), (-1, -1, -0.980), (-0.727, 1, 0.054)), _EN_12368),
    "green": ColorRegion(((0.726, 1, 0.726), (1, -0.625, -0.041), (0, -1, -0.400)), _EN_12368),
    "orange": ColorRegion(
        ((0, -1, -0.320), (-1, -1, -0.980), (0, 1, 0.387)), "EN 12368 has no orange: between its red and its yellow"
    ),
}
"""red: y >= 0.290, y >= 0.980 - x, y <= 0.320; yellow: y >= 0.387, y >= 0.980 - x, y <= 0.727 x + 0.054;
green: y <= 0.726 - 0.726 x, x <= 0.625 y - 0.041, y >= 0.400."""


@cache
def _observer(grid: WavelengthGrid) -> FloatArray:
    """The CIE 1931 2 degree observer's x, y and z, and V(lambda) of 1924, on the grid, ndarray[4, n_wavelengths].

    The tables of colour-science, which takes a second to import. 0 outside 360 to 830 nm, where they are not defined:
    the eye sees next to nothing there.
    """
    with resources.files("sweep.curves.builtin").joinpath(_OBSERVER).open(encoding="utf-8") as file:
        wave, *columns = np.loadtxt(file, delimiter=",", skiprows=1).T
    return np.stack([np.interp(grid.nodes_nm, wave, column, left=0, right=0) for column in columns])


def color_matching(grid: WavelengthGrid) -> FloatArray:
    """CIE 1931 2 degree color-matching functions on the grid, ndarray[3, n_wavelengths]; 0 outside 360 to 830 nm."""
    return _observer(grid)[:3]


VISIBLE_NM = (360.0, 830.0)
"""Where V(lambda) and the color-matching functions are defined (ISO/CIE 11664-1, CIE 018)."""
LUMINOUS_EFFICACY_LM_W = 683.002
"""Luminous efficacy of monochromatic light at 540 THz, which defines the candela."""


_XYZ_TO_RGB = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.204, 1.057]])
"""Matrix of sRGB (IEC 61966-2-1)."""


def luminance_per_photon_radiance(grid: WavelengthGrid, photons: FloatArray) -> FloatArray:
    """cd/m^2 for each photon/s/sr/m^2 of spectra that integrate to one photon: [n, n_wavelengths] -> [n].

    L = 683 integral(V h c / lambda S) d lambda, S in photons per nm; 0 for spectra outside VISIBLE_NM.
    """
    power = energy_from_photons(grid.nodes_nm, photons)
    return np.asarray(LUMINOUS_EFFICACY_LM_W * grid.integrate(power * _observer(grid)[3]), dtype=float)


def chromaticity(grid: WavelengthGrid, photons: FloatArray) -> FloatArray:
    """CIE 1931 x, y of photon spectra: ndarray[n, n_wavelengths] -> ndarray[n, 2]; NaN for what nobody sees."""
    xyz = energy_from_photons(grid.nodes_nm, photons) @ color_matching(grid).T
    return np.asarray(xyz[:, :2] / xyz.sum(axis=1, keepdims=True), dtype=float)


def display_colors(grid: WavelengthGrid, photons: FloatArray) -> FloatArray:
    """sRGB colors in 0..1 to draw lights with, each as bright as its hue allows: ndarray[n, n_wavelengths] -> [n, 3].

    Saturated lights lie outside sRGB; negative primaries are cut off (the color shown is the nearest in hue, not the
    light's own). What nobody sees is gray.
    """
    xyz = energy_from_photons(grid.nodes_nm, photons) @ color_matching(grid).T
    seen = xyz.max(axis=1) > 0
    colors = np.full((len(xyz), 3), _GRAY)
    linear = np.clip(xyz[seen] / xyz[seen].max(axis=1, keepdims=True) @ _XYZ_TO_RGB.T, 0, None)
    linear = linear / linear.max(axis=1, keepdims=True)
    colors[seen] = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return colors
