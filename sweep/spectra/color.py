"""CIE 1931 chromaticity of lights, and color regions of traffic signals, vehicle lamps and sign sheeting."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources

import numpy as np

from ..base.types import Array, Float, SameShape
from .spectrum import WavelengthGrid, energy_from_photons


@dataclass(frozen=True)
class ColorRegion:
    """Convex region of the chromaticity diagram: a x + b y <= c for every (a, b, c) of `bounds`."""

    bounds: tuple[tuple[float, float, float], ...]
    source: str

    def violation(self, xy: Float[Array, "colors 2"]) -> Float[Array, " colors"]:
        """Return the distance of points beyond the bounds.

        Inside where <= 0. It is in x, y; inside where <= 0.
        """
        a, b, c = np.array(self.bounds).T
        return np.asarray((xy[:, :1] * a + xy[:, 1:] * b - c).max(axis=1), dtype=float)


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
def _observer(grid: WavelengthGrid) -> Float[Array, "4 wavelengths"]:
    """Return the CIE 1931 observer's x, y and z, and V(lambda) of 1924, on the grid.

    Tables of colour-science; 0 outside 360 to 830 nm, where they are not defined.
    """
    with resources.files("sweep.spectra.builtin").joinpath(_OBSERVER).open(encoding="utf-8") as file:
        wave, *columns = np.loadtxt(file, delimiter=",", skiprows=1).T
    return np.stack([np.interp(grid.nodes_nm, wave, column, left=0, right=0) for column in columns])


def color_matching(grid: WavelengthGrid) -> Float[Array, "3 wavelengths"]:
    """Return the CIE 1931 2 degree color-matching functions."""
    return _observer(grid)[:3]


VISIBLE_NM = (360.0, 830.0)
"""Where V(lambda) and the color-matching functions are defined (ISO/CIE 11664-1, CIE 018)."""
LUMINOUS_EFFICACY_LM_W = 683.002
"""Luminous efficacy of monochromatic light at 540 THz, which defines the candela."""


XYZ_TO_RGB = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.204, 1.057]])
"""Matrix of sRGB (IEC 61966-2-1)."""


def luminance_per_photon_radiance(
    grid: WavelengthGrid, photons: Float[Array, "spectra wavelengths"]
) -> Float[Array, " spectra"]:
    """Return the luminance per photon radiance: L = 683 integral(V h c / lambda S) d lambda, S in photons per nm.

    `photons`: spectra that integrate to one photon. Returns cd/m2 per photon/s/sr/m2. 0 for spectra outside VISIBLE_NM.
    """
    power = energy_from_photons(grid.nodes_nm, photons)
    return np.asarray(LUMINOUS_EFFICACY_LM_W * grid.integrate(power * _observer(grid)[3]), dtype=float)


def tristimulus(grid: WavelengthGrid, photons: Float[Array, "spectra wavelengths"]) -> Float[Array, "spectra 3"]:
    """Return CIE 1931 X, Y, Z of photon spectra, photons per nm, without a factor of all."""
    energy = energy_from_photons(grid.nodes_nm, photons) * grid.bins_nm
    return np.asarray(energy @ color_matching(grid).T, dtype=float)


def chromaticity(grid: WavelengthGrid, photons: Float[Array, "spectra wavelengths"]) -> Float[Array, "spectra 2"]:
    """Return CIE 1931 x, y of photon spectra.

    `photons`: photon spectra, photons per nm. NaN for invisible spectra. NaN for invisible spectra.
    """
    xyz = tristimulus(grid, photons)
    return np.asarray(xyz[:, :2] / xyz.sum(axis=1, keepdims=True), dtype=float)


def srgb_gamma(linear: SameShape) -> SameShape:
    """Return sRGB values of linear ones (IEC 61966-2-1), 0 to 1."""
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


_R48 = "UN Regulation 48, 2.29, color of the light emitted from a device (red, amber, white)"
_R65 = "UN Regulation 65, special warning lamps (blue)"
LAMP_REGIONS = {
    "red": ColorRegion(((0, 1, 0.335), (-1, -1, -0.980)), _R48),
    "amber": ColorRegion(((-1, 1, -0.120), (0, -1, -0.390), (-0.670, -1, -0.790)), _R48),
    "white": ColorRegion(
        ((-0.640, 1, 0.150), (0, 1, 0.440), (1, 0, 0.500), (0.750, -1, -0.050), (-1, 0, -0.310)),
        f"{_R48}; its convex part",
    ),
    "blue": ColorRegion(((-0.805, 1, 0.065), (1, 1, 0.400), (1, -0.600, 0.133)), _R65),
}
"""red: y <= 0.335, y >= 0.980 - x; amber: y <= x - 0.120, y >= 0.390, y >= 0.790 - 0.670 x; blue: y <= 0.065 + 0.805 x,
y <= 0.400 - x, x <= 0.133 + 0.600 y; white: y <= 0.150 + 0.640 x, y <= 0.440, x <= 0.500, y >= 0.050 + 0.750 x,
x >= 0.310 (right of x = 0.443 the regulation lets y down to 0.382)."""

_ITE = "ITE, Vehicle Traffic Control Signal Heads, 1985, and its part 2 of 1998 for LED modules"
SIGNAL_REGIONS: Mapping[str, Mapping[str, ColorRegion]] = {
    "en_12368": {kind: REGIONS[kind] for kind in ("yellow", "red")},
    "ite": {
        "yellow": ColorRegion(((0, -1, -0.411), (0, 1, 0.452), (-1, -1, -0.995)), _ITE),
        "red": ColorRegion(((0, 1, 0.308), (-1, -1, -0.998)), _ITE),
    },
    "un_r48": {"yellow": LAMP_REGIONS["amber"], "red": LAMP_REGIONS["red"]},
}
"""Yellow and red lights that a norm allows, between these bounds and the spectral locus, with corners (x, y).

EN 12368: yellow (0.593, 0.387), (0.536, 0.444), red (0.660, 0.320), (0.690, 0.290). ITE: yellow 0.411 <= y <= 0.452,
y >= 0.995 - x: (0.584, 0.411), (0.543, 0.452), red y <= 0.308, y >= 0.998 - x: (0.690, 0.308). ITE's supplement for
LED circular signals of 2005, which replaced part 2, is not in it: its bounds could not be read. Bounds of both as
compared by the Lighting Research Center, Rensselaer, "LED Traffic Signal Comparison". UN R48, which SAE J578 shares:
yellow (0.545, 0.425), (0.597, 0.390), red (0.645, 0.335), (0.721, 0.259), of vehicles' lamps.
"""
_J578 = "SAE J578-2020, 3.1.6, for automated driving system marker lamps (SAE J3134); read in one summary"
MARKER_REGIONS: Mapping[str, ColorRegion] = {
    "blue-green marker lamps of SAE J578": ColorRegion(((0.5, 1, 0.5), (1, 0, 0.2), (0, -1, -0.32)), _J578)
}
"""Colors of other lamps that a signal may have, too: blue-green, y <= 0.500 - 0.500 x, x <= 0.200, y >= 0.320, overlaps
EN 12368's green where LEDs of 495 to 498 nm lie."""
NORM_NAMES: Mapping[str, str] = {"en_12368": "EN 12368", "ite": "ITE (1985, 1998)", "un_r48": "UN R48 and SAE J578"}


def corners(*points: tuple[float, float], source: str) -> ColorRegion:
    """Return the convex region with some corners."""
    area = sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(points, (*points[1:], points[0]), strict=True))
    ordered = points if area > 0 else points[::-1]
    bounds = []
    for (x0, y0), (x1, y1) in zip(ordered, (*ordered[1:], ordered[0]), strict=True):
        normal = (y1 - y0, x0 - x1)  # outward of a polygon that runs counterclockwise
        bounds.append((*normal, normal[0] * x0 + normal[1] * y0))
    return ColorRegion(tuple(bounds), source)


_FHWA = "23 CFR 655, subpart F, appendix, table 1: daytime color of retroreflective sign material (D65, 2 degrees)"
SHEETING_REGIONS = {
    "white": corners((0.303, 0.300), (0.368, 0.366), (0.340, 0.393), (0.274, 0.329), source=_FHWA),
    "red": corners((0.648, 0.351), (0.735, 0.265), (0.629, 0.281), (0.565, 0.346), source=_FHWA),
    "orange": corners((0.558, 0.352), (0.636, 0.364), (0.570, 0.429), (0.506, 0.404), source=_FHWA),
    "yellow": corners((0.498, 0.412), (0.557, 0.442), (0.479, 0.520), (0.438, 0.472), source=_FHWA),
    "green": corners((0.026, 0.399), (0.166, 0.364), (0.286, 0.446), (0.207, 0.771), source=_FHWA),
    "blue": corners((0.140, 0.035), (0.244, 0.210), (0.190, 0.255), (0.065, 0.216), source=_FHWA),
}
"""Corners (x, y) of each color. White was compared with a published table of these limits (ASTM D4956), the others with
none."""
