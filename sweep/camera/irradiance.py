"""Photon irradiance on the sensor: radiance of the lights through air and lens.

`scene_irradiance` computes the irradiance of a scene and passes it through the effects of user code. Extinction by haze
and fog dims a target, but not the background, which is nearer. Off axis a lens without vignetting transmits cos^4 of
the light, of the background, too.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ..base.types import Array, Float, PerWavelength
from ..spectra.color import luminance_per_photon_radiance
from .pixel import irradiance_factor
from .scene import Scene
from .setup import Setup
from .user_effects import Irradiance

_REFERENCE_NM = 550.0
_CONTRAST = 0.02


def scene_irradiance(setup: Setup) -> Irradiance:
    """Return the irradiance of a scene behind veiling glare and the effects of user code, photons/s/m2/nm."""
    irradiance = Irradiance(setup.camera.grid.nodes_nm, _signals(setup), _uniform(setup, setup.scene.background_cd_m2))
    if setup.scene.veiling_glare is not None and setup.computes("veiling glare"):
        glare = setup.scene.veiling_glare
        mean_cd_m2 = setup.scene.background_cd_m2 if glare.field_cd_m2 is None else glare.field_cd_m2
        # As much in the corner as in the center: the loss of the lens off axis, which follows, does not touch it.
        dimmed = relative_illumination(setup.scene) if setup.computes("illumination") else 1.0
        irradiance = with_veiling_glare(irradiance, glare.share, _uniform(setup, mean_cd_m2) / dimmed)
    for effect in setup.user_effects:
        signals, background = effect.applied(irradiance, setup.scene)
        irradiance = replace(irradiance, signals=signals, background=background)
    return irradiance


def with_veiling_glare(irradiance: Irradiance, share: float, mean: PerWavelength) -> Irradiance:
    """Spread a share of the mean light of the field evenly over the field (integral of veiling glare, ISO 9358).

    `irradiance`: irradiance of a lens without glare; `share`: share, 0 to 1, that each pixel loses of its own light.
    `mean` leaves out the light of a signal, which is small in the field.
    """
    unscattered = 1 - share
    background = unscattered * irradiance.background + share * mean
    return replace(irradiance, signals=unscattered * irradiance.signals, background=background)


def signal_irradiance(setup: Setup) -> Float[Array, "signals wavelengths"]:
    """Return the photon irradiance of each signal, photons/s/m2/nm."""
    return scene_irradiance(setup).signals


def background_irradiance(setup: Setup) -> PerWavelength:
    """Return the photon irradiance of the uniform background, photons/s/m2/nm."""
    return scene_irradiance(setup).background


def _signals(setup: Setup) -> Float[Array, "signals wavelengths"]:
    """Return the irradiance of each signal from its radiance or luminance."""
    scene = setup.scene
    factor = irradiance_factor(scene.optics)
    luminance = scene.luminance_cd_m2
    if luminance is None:
        return setup.lights.photons * (scene.photon_radiance * factor)
    per_photon_radiance = luminance_per_photon_radiance(setup.camera.grid, setup.lights.photons)
    return setup.lights.photons * (luminance / per_photon_radiance * factor)[:, None]


def _uniform(setup: Setup, luminance_cd_m2: float) -> PerWavelength:
    """Return the irradiance of a uniform light, flat in photons."""
    grid = setup.camera.grid
    if not luminance_cd_m2:
        return np.zeros(grid.size)
    flat = np.full((1, grid.size), 1 / grid.span_nm)
    radiance = luminance_cd_m2 / luminance_per_photon_radiance(grid, flat)[0]
    return np.asarray(flat[0] * radiance * irradiance_factor(setup.scene.optics), dtype=float)


def size_exponent(visibility_m: float) -> float:
    """Return the exponent of the wavelength in extinction (Kim, McArthur, Korevaar, 2001).

    Returns exponent q: 0 in dense fog, 1.6 in clear air.
    """
    km = visibility_m / 1000
    if km < 0.5:
        return 0.0
    if km < 1:
        return km - 0.5
    if km < 6:
        return 0.16 * km + 0.34
    return 1.3 if km < 50 else 1.6


def air_transmittance(scene: Scene, wavelength_nm: PerWavelength) -> PerWavelength:
    """Return the transmittance of the air between target and camera, 0 to 1.

    exp(-beta D) with beta = ln(1 / 0.02) / visibility (lambda / 550 nm)^-q (Koschmieder).
    """
    if scene.visibility_m is None or scene.target is None:
        return np.ones(wavelength_nm.size)
    exponent = size_exponent(scene.visibility_m)
    per_m = -math.log(_CONTRAST) / scene.visibility_m * (wavelength_nm / _REFERENCE_NM) ** -exponent
    return np.asarray(np.exp(-per_m * scene.target.distance_m), dtype=float)


def relative_illumination(scene: Scene) -> float:
    """Return the relative illumination of a lens without vignetting, cos^4 of the field angle, 0 to 1."""
    return math.cos(math.radians(scene.off_axis_deg)) ** 4


def path_factor(setup: Setup, wavelength_nm: PerWavelength, *, background: bool = False) -> PerWavelength:
    """Return the factor of air and lens on the light of a signal or of the background, 0 to 1."""
    result = np.ones(wavelength_nm.size)
    if setup.computes("illumination"):
        result *= relative_illumination(setup.scene)
    if setup.computes("extinction") and not background:
        result *= air_transmittance(setup.scene, wavelength_nm)
    return result
