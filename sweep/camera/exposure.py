"""Exposure time: fixed, or set by the brightest channel on a white patch; and the light of a scene before any pixel."""

from __future__ import annotations

import numpy as np

from ..base.types import FloatArray
from . import pwm
from .angular import AngularResponse
from .field import over_field
from .irradiance import signal_irradiance
from .pixel import irradiance_factor
from .scene import WhitePatchExposure
from .setup import Setup


def white_irradiance(setup: Setup) -> FloatArray:
    """Photon irradiance of the white patch, flat in photons, ndarray[n_wavelengths]."""
    scenario, grid = setup.scene, setup.camera.grid
    ratio = setup.lights.photon_ratio
    if isinstance(scenario.exposure, WhitePatchExposure) and scenario.exposure.photon_ratio is not None:
        ratio = scenario.exposure.photon_ratio
    radiance = scenario.photon_radiance * irradiance_factor(scenario.optics)
    return np.full(grid.size, radiance / (ratio * grid.size * grid.step_nm))


def fixed_white(setup: Setup) -> float:
    """Electrons/s on the white patch of the brightest channel that no design modifies."""
    rates = setup.camera.qe[list(setup.camera.fixed)] @ white_irradiance(setup) * setup.camera.area_step_m2_nm
    return float(rates.max(initial=0.0))


def exposure_times(setup: Setup, modified_white: FloatArray, fixed: float | None = None) -> FloatArray:
    """Exposure of each design, s, ndarray[n_designs]; infinite where a white-patch exposure sees no light.

    `modified_white`: electrons/s of the modified channels on the white patch, ndarray[n_designs, n_modified]. `fixed`:
    `fixed_white` of the setup, where it is known.
    """
    exposure = setup.scene.exposure
    if not isinstance(exposure, WhitePatchExposure):
        return np.full(len(modified_white), exposure.exposure_s)
    brightest = np.maximum(modified_white.max(axis=1, initial=0.0), fixed_white(setup) if fixed is None else fixed)
    full_e = exposure.level * setup.camera.pixel.full_scale_dn / setup.camera.pixel.dn_per_e
    with np.errstate(divide="ignore"):
        return np.asarray(full_e / brightest, dtype=float)


def may_set_exposure(setup: Setup, most: float = 1.0) -> bool:
    """Whether a modified channel up to its base curve may be the one that is exposed for: the brightest on white.

    `most`: the largest sensitivity that it has, its sum over that of its base curve.
    """
    return isinstance(setup.scene.exposure, WhitePatchExposure) and not leaves_exposure(setup) >= most


def leaves_exposure(setup: Setup) -> float:
    """The largest sensitivity with which no modified channel is the brightest on white; infinite for dark bases.

    The white patch is flat in photons, so sums of the curves say it, the same for equal curves.
    """
    camera, rates = setup.camera, setup.camera.qe.sum(axis=1)
    kept, modified = (rates[list(some)].max(initial=0.0) for some in (camera.fixed, camera.modified))
    return float(kept / modified) if modified > 0 else np.inf


def relative_slope(setup: Setup, white: FloatArray, curves: FloatArray, curves_gradient: FloatArray) -> FloatArray:
    """Derivative of one design's exposure over that exposure, ndarray[n_parameters].

    `white`: electrons/s for each QE of the white patch, ndarray[n_wavelengths]; `curves`: QE of the modified channels,
    ndarray[n_modified, n_wavelengths]; `curves_gradient`: its derivative, ndarray[n_parameters, n_modified,
    n_wavelengths].
    """
    # By the same products: a filter that leaves its base as it is, beside a pixel of that curve, sets nothing.
    rates, kept = curves @ white, setup.camera.qe[list(setup.camera.fixed)] @ white
    of_white = isinstance(setup.scene.exposure, WhitePatchExposure)
    if not of_white or not rates.size or not rates.max() > kept.max(initial=0.0):
        return np.zeros(len(curves_gradient))
    top = int(np.argmax(rates))
    return np.asarray(-(curves_gradient[:, top] @ white) / rates[top], dtype=float)


class SceneLight:
    """The light of a scene.

    `signals`, `white`: electrons/s for each QE of light and the white patch at every wavelength, ndarray[n_signals,
    n_wavelengths] and ndarray[n_wavelengths]; `fixed_white`: of the brightest channel that no design modifies.
    `moments`: of a pulse, instead of those of the accuracy (see `pwm.scales`). `positions`: a setup of each field
    position; `angular`: the filters as the rays see them there.
    """

    def __init__(self, setup: Setup) -> None:
        self.setup = setup
        self.moments: FloatArray | None = None
        self.signals = signal_irradiance(setup) * setup.camera.area_step_m2_nm
        self.white = white_irradiance(setup) * setup.camera.area_step_m2_nm
        self.fixed_white = fixed_white(setup)
        self.positions = over_field(setup)
        self.angular = [AngularResponse(position) for position in self.positions]

    def exposure_s(self, curves: FloatArray) -> FloatArray:
        """Exposure of each design, s, ndarray[n_designs]; `curves`: ndarray[n_designs, n_modified, n_wavelengths]."""
        return exposure_times(self.setup, curves @ self.white, self.fixed_white)

    def scales(self, exposure_s: FloatArray) -> FloatArray:
        """Light relative to its mean at the moments of a pulsed light, ndarray[n_designs, n_moments]."""
        return pwm.scales(self.setup, exposure_s, self.moments)
