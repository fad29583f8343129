"""CIE 1931 chromaticity of lights, and the color regions of traffic signals."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

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
def color_matching(grid: WavelengthGrid) -> FloatArray:
    """CIE 1931 2 degree color-matching functions on the grid, ndarray[3, n_wavelengths] (colour-science).

    0 outside 360 to 830 nm, where they are not defined: the eye sees next to nothing there.
    """
    from colour import MSDS_CMFS  # noqa: PLC0415  (more than a second to import)

    functions = MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    wave = functions.wavelengths
    return np.stack([np.interp(grid.nodes_nm, wave, column, left=0, right=0) for column in functions.values.T])


VISIBLE_NM = (360.0, 830.0)
"""Where V(lambda) and the color-matching functions are defined (ISO/CIE 11664-1, CIE 018)."""
LUMINOUS_EFFICACY_LM_W = 683.002
"""Of monochromatic light at 540 THz, which defines the candela."""


@cache
def _photopic(grid: WavelengthGrid) -> FloatArray:
    """V(lambda), CIE 1924, on the grid, ndarray[n_wavelengths] (colour-science)."""
    from colour import SDS_LEFS  # noqa: PLC0415  (more than a second to import)

    efficiency = SDS_LEFS["CIE 1924 Photopic Standard Observer"]
    return np.asarray(
        np.interp(grid.nodes_nm, efficiency.wavelengths, efficiency.values, left=0.0, right=0.0), dtype=float
    )


def luminance_per_photon_radiance(grid: WavelengthGrid, photons: FloatArray) -> FloatArray:
    """cd/m^2 for each photon/s/sr/m^2 of spectra that integrate to one photon: [n, n_wavelengths] -> [n].

    L = 683 integral(V h c / lambda S) d lambda, S in photons per nm; 0 for spectra outside VISIBLE_NM.
    """
    power = energy_from_photons(grid.nodes_nm, photons)
    return np.asarray(LUMINOUS_EFFICACY_LM_W * grid.integrate(power * _photopic(grid)), dtype=float)


def chromaticity(grid: WavelengthGrid, photons: FloatArray) -> FloatArray:
    """CIE 1931 x, y of photon spectra: ndarray[n, n_wavelengths] -> ndarray[n, 2]; NaN for what nobody sees."""
    xyz = energy_from_photons(grid.nodes_nm, photons) @ color_matching(grid).T
    return np.asarray(xyz[:, :2] / xyz.sum(axis=1, keepdims=True), dtype=float)


def display_colors(grid: WavelengthGrid, photons: FloatArray) -> FloatArray:
    """sRGB colors in 0..1 to draw lights with, each as bright as its hue allows: ndarray[n, n_wavelengths] -> [n, 3].

    Saturated lights lie outside sRGB; negative primaries are cut off (the color shown is the nearest in hue, not the
    light's own). What nobody sees is gray.
    """
    from colour.models import XYZ_to_sRGB, eotf_inverse_sRGB  # noqa: PLC0415  (more than a second to import)

    xyz = energy_from_photons(grid.nodes_nm, photons) @ color_matching(grid).T
    seen = xyz.max(axis=1) > 0
    colors = np.full((len(xyz), 3), _GRAY)
    linear = np.clip(XYZ_to_sRGB(xyz[seen] / xyz[seen].max(axis=1, keepdims=True), apply_cctf_encoding=False), 0, None)
    colors[seen] = eotf_inverse_sRGB(linear / linear.max(axis=1, keepdims=True))
    return colors
