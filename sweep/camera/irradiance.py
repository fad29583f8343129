"""Photon irradiance on the sensor: radiance of the lights through air and lens.

`scene_irradiance` makes that of a scene, and hands it to the effects of a user's own, one after the other.

Extinction by haze and fog dims a target and not the background, which is nearer. Off axis a lens without vignetting
gives cos^4 of the light, of the background, too.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ..base.types import FloatArray
from ..curves.color import luminance_per_photon_radiance
from .own_effects import Irradiance
from .pixel import irradiance_factor
from .scene import Scene
from .setup import Setup

_REFERENCE_NM = 550.0
_CONTRAST = 0.02


def scene_irradiance(setup: Setup) -> Irradiance:
    """Return the irradiance of a scene behind the effects of a user's own."""
    irradiance = Irradiance(setup.camera.grid.nodes_nm, _signals(setup), _uniform(setup, setup.scene.background_cd_m2))
    if setup.scene.veiling_glare is not None:
        glare = setup.scene.veiling_glare
        mean_cd_m2 = setup.scene.background_cd_m2 if glare.field_cd_m2 is None else glare.field_cd_m2
        irradiance = with_veiling_glare(irradiance, glare.share, _uniform(setup, mean_cd_m2))
    for effect in setup.own_effects:
        signals, background = effect.applied(irradiance, setup.scene)
        irradiance = replace(irradiance, signals=signals, background=background)
    return irradiance


def with_veiling_glare(irradiance: Irradiance, share: float, mean: FloatArray) -> Irradiance:
    """Spread a share of the mean light of the field evenly over the field (ISO 9358's integral of veiling glare).

    Parameters
    ----------
    irradiance : Irradiance
        That of a lens without glare.
    share : float
        0 to 1, which every pixel lacks of its own light.
    mean : ndarray[n_wavelengths]
        Mean irradiance of the field. The light of a signal, which is small in the field, is left out of it.
    """
    kept = 1 - share
    background = kept * irradiance.background + share * mean
    return replace(irradiance, signals=kept * irradiance.signals, background=background)


def signal_irradiance(setup: Setup) -> FloatArray:
    """Photon irradiance of each signal, ndarray[n_signals, n_wavelengths]; see `Irradiance`."""
    return scene_irradiance(setup).signals


def background_irradiance(setup: Setup) -> FloatArray:
    """Photon irradiance of the uniform background, ndarray[n_wavelengths]; see `Irradiance`."""
    return scene_irradiance(setup).background


def _signals(setup: Setup) -> FloatArray:
    """Irradiance of each signal, of its radiance or its luminance, ndarray[n_signals, n_wavelengths]."""
    scene = setup.scene
    factor = irradiance_factor(scene.optics)
    luminance = scene.luminance_cd_m2
    if luminance is None:
        return setup.lights.photons * (scene.photon_radiance * factor)
    per_photon_radiance = luminance_per_photon_radiance(setup.camera.grid, setup.lights.photons)
    return setup.lights.photons * (luminance / per_photon_radiance * factor)[:, None]


def _uniform(setup: Setup, luminance_cd_m2: float) -> FloatArray:
    """Irradiance of a uniform light of some luminance, flat in photons, ndarray[n_wavelengths]."""
    grid = setup.camera.grid
    if not luminance_cd_m2:
        return np.zeros(grid.size)
    flat = np.full((1, grid.size), 1 / (grid.size * grid.step_nm))
    radiance = luminance_cd_m2 / luminance_per_photon_radiance(grid, flat)[0]
    return np.asarray(flat[0] * radiance * irradiance_factor(setup.scene.optics), dtype=float)


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


def way_of_light(setup: Setup, wavelength_nm: FloatArray, *, background: bool = False) -> FloatArray:
    """Factor of air and lens on a signal's light, or on that of the `background`, ndarray[n_wavelengths]."""
    result = np.ones(wavelength_nm.size)
    if setup.computes("illumination"):
        result *= relative_illumination(setup.scene)
    if setup.computes("extinction") and not background:
        result *= air_transmittance(setup.scene, wavelength_nm)
    return result
