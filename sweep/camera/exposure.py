"""Exposure time, fixed or set by the brightest channel on a white patch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..base.types import (
    Array,
    ChannelCurves,
    CurvesGradient,
    Float,
    PerDesign,
    PerParameter,
    PerWavelength,
)
from .pixel import irradiance_factor
from .scene import FixedExposure, WhitePatchExposure
from .setup import Setup


def white_irradiance(setup: Setup) -> PerWavelength:
    """Return the photon irradiance of the white patch, which is flat in photons, photons/s/m2/nm."""
    scenario, grid = setup.scene, setup.camera.grid
    ratio = setup.lights.photon_ratio
    if isinstance(scenario.exposure, WhitePatchExposure) and scenario.exposure.photon_ratio is not None:
        ratio = scenario.exposure.photon_ratio
    radiance = scenario.photon_radiance * irradiance_factor(scenario.optics)
    return np.full(grid.size, radiance / (ratio * grid.span_nm))


def fixed_white(setup: Setup) -> float:
    """Return electrons/s on the white patch of the brightest channel that no design modifies."""
    rates = setup.camera.qe[list(setup.camera.fixed)] @ (white_irradiance(setup) * setup.camera.area_bins_m2_nm)
    return float(rates.max(initial=0.0))


def exposure_times(
    setup: Setup, modified_white: Float[Array, "designs modified"], fixed: float | None = None
) -> PerDesign:
    """Return the exposure time of each design.

    `modified_white`: electrons/s of the modified channels on the white patch; `fixed`: result of `fixed_white`, if it
    is known. Infinite if a white-patch exposure sees no light.
    """
    exposure = setup.scene.exposure
    if not isinstance(exposure, WhitePatchExposure):
        return np.full(len(modified_white), exposure.exposure_s)
    brightest = np.maximum(modified_white.max(axis=1, initial=0.0), fixed_white(setup) if fixed is None else fixed)
    full_e = exposure.level * setup.camera.pixel.full_scale_dn / setup.camera.pixel.dn_per_e
    with np.errstate(divide="ignore"):
        return np.asarray(full_e / brightest, dtype=float)


def may_be_brightest(setup: Setup, most: float = 1.0) -> bool:
    """Return whether a modified channel below its base curve may be the brightest on white and set the exposure.

    `most`: largest sensitivity of the channel: the integral of its curve over that of its base.
    """
    return isinstance(setup.scene.exposure, WhitePatchExposure) and not largest_sensitivity_not_brightest(setup) >= most


def largest_sensitivity_not_brightest(setup: Setup) -> float:
    """Return the largest sensitivity at which no modified channel is the brightest on white.

    Infinite for dark base curves.
    """
    camera, rates = setup.camera, setup.camera.grid.integrate(setup.camera.qe)
    fixed_rate, modified = (rates[list(channels)].max(initial=0.0) for channels in (camera.fixed, camera.modified))
    return float(fixed_rate / modified) if modified > 0 else np.inf


def exposed_at(setup: Setup, sensitivity: float) -> Setup:
    """Return the setup with the exposure time that it has where the only modified channel has a sensitivity."""
    white = setup.camera.base_qe @ (sensitivity * white_irradiance(setup) * setup.camera.area_bins_m2_nm)
    (time_s,) = exposure_times(setup, white[None])
    scene = setup.scene.model_copy(update={"exposure": FixedExposure(exposure_s=float(time_s))})
    return replace(setup, scene=scene)


def relative_slope(
    setup: Setup, white: PerWavelength, curves: ChannelCurves, curves_gradient: CurvesGradient
) -> PerParameter:
    """Return the derivative of one design's exposure time, relative to that time, per unit of parameter.

    `white`: electrons/s of the white patch per unit of QE.
    """
    # By the same products: a filter that leaves its base as it is, beside a pixel of that curve, sets nothing.
    rates, fixed_rates = curves @ white, setup.camera.qe[list(setup.camera.fixed)] @ white
    of_white = isinstance(setup.scene.exposure, WhitePatchExposure)
    if not of_white or not rates.size or not rates.max() > fixed_rates.max(initial=0.0):
        return np.zeros(len(curves_gradient))
    top = int(np.argmax(rates))
    return np.asarray(-(curves_gradient[:, top] @ white) / rates[top], dtype=float)
