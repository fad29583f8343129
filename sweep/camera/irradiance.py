"""Photon irradiance on the sensor: radiance of the lights through air and lens.

Extinction by haze and fog dims a target and not the background, which is nearer. Off axis a lens without vignetting
gives cos^4 of the light, of the background, too.
"""

from __future__ import annotations

import math

import numpy as np

from ..base.types import FloatArray
from ..curves.color import luminance_per_photon_radiance
from .pixel import irradiance_factor
from .scene import Scene
from .view import View

_REFERENCE_NM = 550.0
_CONTRAST = 0.02


def signal_irradiance(view: View) -> FloatArray:
    """Photon irradiance of each signal where its image is whole, on axis, in clear air, photons/s/m^2/nm.

    ndarray[n_signals, n_wavelengths].
    """
    scene = view.scenario
    factor = irradiance_factor(scene.optics)
    luminance = scene.luminance_cd_m2
    if luminance is None:
        return view.lights.photons * (scene.photon_radiance * factor)
    per_photon_radiance = luminance_per_photon_radiance(view.grid, view.lights.photons)
    return view.lights.photons * (luminance / per_photon_radiance * factor)[:, None]


def background_irradiance(view: View) -> FloatArray:
    """Photon irradiance of the uniform background on axis, flat in photons, ndarray[n_wavelengths]."""
    grid, luminance = view.grid, view.scenario.background_cd_m2
    if not luminance:
        return np.zeros(grid.size)
    flat = np.full((1, grid.size), 1 / (grid.size * grid.step_nm))
    radiance = luminance / luminance_per_photon_radiance(grid, flat)[0]
    return np.asarray(flat[0] * radiance * irradiance_factor(view.scenario.optics), dtype=float)


def size_exponent(visibility_m: float) -> float:
    """Exponent q of the wavelength in extinction (Kim, McArthur, Korevaar 2001): 0 in dense fog, 1.6 in clear air."""
    km = visibility_m / 1000
    if km < 0.5:
        return 0.0
    if km < 1:
        return km - 0.5
    if km < 6:
        return 0.16 * km + 0.34
    return 1.3 if km < 50 else 1.6


def air_transmittance(scene: Scene, wavelength_nm: FloatArray) -> FloatArray:
    """Share of a target's light that the air lets through, ndarray[n_wavelengths].

    exp(-beta D); beta = ln(1 / 0.02) / visibility (lambda / 550 nm)^-q (Koschmieder).
    """
    if scene.visibility_m is None or scene.target is None:
        return np.ones(wavelength_nm.size)
    exponent = size_exponent(scene.visibility_m)
    per_m = -math.log(_CONTRAST) / scene.visibility_m * (wavelength_nm / _REFERENCE_NM) ** -exponent
    return np.asarray(np.exp(-per_m * scene.target.distance_m), dtype=float)


def relative_illumination(scene: Scene) -> float:
    """cos^4 of the field angle."""
    return math.cos(math.radians(scene.off_axis_deg)) ** 4


def way_of_light(view: View, wavelength_nm: FloatArray, *, background: bool = False) -> FloatArray:
    """Factor of air and lens on a signal's light, or on that of the `background`, ndarray[n_wavelengths]."""
    result = np.ones(wavelength_nm.size)
    if view.computes("illumination"):
        result *= relative_illumination(view.scenario)
    if view.computes("extinction") and not background:
        result *= air_transmittance(view.scenario, wavelength_nm)
    return result
