"""Spectra of surfaces and illuminants: of CIE, of the ColorChecker (through colour-science), and measured ones.

Surfaces are patches of the ColorChecker (N. Ohta, 1997): `foliage`, `blue sky` and its neutral row; or the mean of a
group that the package ships (`sweep list data`): measured soil, asphalt and concrete, modeled canopies. Street light
is CIE's LED-B3 (a phosphor LED of 4100 K) or HP1 (high-pressure sodium), CIE 015:2018.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from ...base.types import Array, Float, PerWavelength
from ...spectra.builtin.groups import spectra_of_group
from ...spectra.spectrum import WavelengthGrid
from .keys import Illuminant, Material

_ILLUMINANTS: dict[Illuminant, str] = {
    "daylight": "D65",
    "LED street light": "LED-B3",
    "sodium street light": "HP1",
}
_PATCHES: dict[Material, str] = {
    "foliage": "foliage",
    "sky": "blue sky",
    "gray": "neutral 5 (.70 D)",
    "dark gray": "neutral 3.5 (1.05 D)",
    "black": "black 2 (1.5 D)",
    "white": "white 9.5 (.05 D)",
}
_LENS_EDGES_NM: dict[str, tuple[float, float]] = {
    "red": (600.0, 1e4),
    "orange": (582.0, 1e4),
    "yellow": (565.0, 1e4),
    "green": (470.0, 560.0),
}
_LENS_WIDTH_NM = 6.0


@cache
def ambient_light(grid: WavelengthGrid, name: Illuminant) -> PerWavelength:
    """Return the photons of an illuminant, normalized to an integral of 1."""
    from colour import SDS_ILLUMINANTS  # noqa: PLC0415  (more than a second to import)

    held = SDS_ILLUMINANTS[_ILLUMINANTS[name]]
    photons = np.interp(grid.nodes_nm, held.wavelengths, held.values, left=0.0, right=0.0) * grid.nodes_nm
    return np.asarray(photons / grid.integrate(photons), dtype=float)


@cache
def reflectance(grid: WavelengthGrid, name: Material) -> PerWavelength:
    """Return the reflectance of a surface; constant beyond its range, 0 for those of a group, 0 to 1."""
    if name not in _PATCHES:
        return np.asarray(spectra_of_group(grid, name).mean(axis=0), dtype=float)
    from colour import SDS_COLOURCHECKERS  # noqa: PLC0415  (more than a second to import)

    held = SDS_COLOURCHECKERS["ColorChecker N Ohta"][_PATCHES[name]]
    return np.asarray(np.interp(grid.nodes_nm, held.wavelengths, held.values), dtype=float)


@cache
def chart_reflectances(grid: WavelengthGrid) -> Float[Array, "24 wavelengths"]:
    """Return the reflectances of the 24 patches of the ColorChecker; constant beyond their range, 0 to 1."""
    from colour import SDS_COLOURCHECKERS  # noqa: PLC0415  (more than a second to import)

    held = SDS_COLOURCHECKERS["ColorChecker N Ohta"].values()
    return np.stack([np.interp(grid.nodes_nm, patch.wavelengths, patch.values) for patch in held])


def phantom(grid: WavelengthGrid, kind: str) -> PerWavelength:
    """Return the photons of daylight reflected by a colored lens, normalized to an integral of 1.

    The lens is modeled, not measured: a band with logistic edges, passed twice. A lens of another signal type than
    red, orange, yellow and green is clear.
    """
    nodes = grid.nodes_nm
    passed = np.ones(nodes.size)
    if kind in _LENS_EDGES_NM:
        low, high = _LENS_EDGES_NM[kind]
        z_low, z_high = (np.clip((nodes - edge) / _LENS_WIDTH_NM, -500, 500) for edge in (low, high))
        passed = (1 / (1 + np.exp(-z_low)) * (1 / (1 + np.exp(z_high)))) ** 2
    photons = ambient_light(grid, "daylight") * passed
    return np.asarray(photons / grid.integrate(photons), dtype=float)
