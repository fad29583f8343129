"""What a block of designs shares: sensor, CFA, lights and scene, and how the scene is simulated."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..base.types import FloatArray
from ..curves.color import luminance_per_photon_radiance
from .methods import REFERENCE, Methods
from .pixel import irradiance_factor
from .shot import Shot


@dataclass(frozen=True)
class View(Shot):
    """A shot, and the methods by which it is simulated."""

    methods: Methods = field(default=REFERENCE)


def signal_irradiance(view: View) -> FloatArray:
    """Photon irradiance of each signal where its image is whole, on axis, in clear air, photons/s/m^2/nm.

    ndarray[n_signals, n_wavelengths].
    """
    scenario = view.scenario
    factor = irradiance_factor(scenario.optics)
    luminance = scenario.luminance_cd_m2
    if luminance is None:
        return view.lights.photons * (scenario.photon_radiance * factor)
    per_photon = luminance_per_photon_radiance(view.grid, view.lights.photons)
    return view.lights.photons * (luminance / per_photon * factor)[:, None]


def background_irradiance(view: View) -> FloatArray:
    """Photon irradiance of the uniform background, flat in photons, ndarray[n_wavelengths]."""
    grid, luminance = view.grid, view.scenario.background_cd_m2
    if not luminance:
        return np.zeros(grid.size)
    flat = np.full((1, grid.size), 1 / (grid.size * grid.step_nm))
    radiance = luminance / luminance_per_photon_radiance(grid, flat)[0]
    return np.asarray(flat[0] * radiance * irradiance_factor(view.scenario.optics), dtype=float)


def per_photon(view: View) -> float:
    """Electrons per second, for each unit of sum over wavelengths of irradiance times QE: A FF dl."""
    return view.grid.step_nm * view.pixel.area_m2
