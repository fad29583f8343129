"""What a block of designs shares: sensor, CFA, lights and scene, and how the scene is simulated."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from ..curves.color import luminance_per_photon_radiance
from ..curves.lights import Lights
from ..curves.spectrum import WavelengthGrid
from ..errors import Fault, SweepError, nearest
from ..types import FloatArray, IndexArray
from .mosaic import Mosaic
from .pixel import Pixel, irradiance_factor
from .scene import Scenario, WhitePatchExposure

METHODS: Mapping[str, tuple[str, ...]] = {
    "noise": ("skip", "expected"),
    "quantization": ("skip", "round"),
    "saturation": ("skip", "clip"),
    "pedestal": ("skip", "add"),
    "quadrature": ("every 10th", "every 5th", "every 2nd", "grid"),
    "sampling": ("skip", "pixels"),
    "phase": (
        "one",
        "pixel",
        "half pixel",
        "quarter pixel",
        "within 10 DN",
        "within 1 DN",
        "within 0.1 DN",
        "within 0.01 DN",
        "within 0.0001 DN",
    ),
    "demosaic": ("skip", "tent"),
    "blur": ("skip", "every 10 nm", "every 5 nm", "every 2 nm", "every wavelength"),
    "crosstalk": ("skip", "neighbors"),
    "illumination": ("skip", "cos4"),
    "extinction": ("skip", "gray", "spectral"),
    "flicker": ("skip", "ends", "fine"),
}
"""Every effect of the image chain with its methods, from the cheapest to the reference."""


@dataclass(frozen=True, init=False)
class Methods:
    """How each effect of the image chain is computed; what is not named, as in the reference, with everything on.

    Raises SweepError for an effect or a method that does not exist.
    """

    noise: str
    quantization: str
    saturation: str
    pedestal: str
    quadrature: str
    sampling: str
    phase: str
    demosaic: str
    blur: str
    crosstalk: str
    illumination: str
    extinction: str
    flicker: str

    def __init__(self, **methods: str) -> None:
        _refuse_unknown("effect", methods, METHODS)
        for effect, known in METHODS.items():
            method = methods.get(effect, known[-1])
            _refuse_unknown(f"method of {effect}", (method,), known)
            object.__setattr__(self, effect, method)

    @property
    def straight(self) -> bool:
        """Whether digital numbers are linear in electrons: neither clipped nor rounded."""
        return self.saturation == "skip" and self.quantization == "skip"


def _refuse_unknown(what: str, names: Iterable[str], known: Collection[str]) -> None:
    for name in names:
        if name not in known:
            raise SweepError(
                Fault(f"unknown {what}", value=name, allowed=", ".join(known), nearest=nearest(name, known))
            )


REFERENCE = Methods()


@dataclass(frozen=True)
class Setup:
    """All that a block of designs shares.

    `qe`: ndarray[n_channels, n_wavelengths] of the mosaic's channels, electrons per photon; the rows of `modified`
    (channel indices, one per curve that a family makes) hold the base curve. `clear_qe`: the reference of the CFA's
    sensitivity, ndarray[n_wavelengths].
    """

    grid: WavelengthGrid
    mosaic: Mosaic
    qe: FloatArray
    modified: tuple[int, ...]
    clear_qe: FloatArray
    lights: Lights
    pixel: Pixel
    scenario: Scenario
    methods: Methods = field(default=REFERENCE)

    @property
    def base_qe(self) -> FloatArray:
        """Curves that the modified channels replace, ndarray[n_modified, n_wavelengths]."""
        return self.qe[list(self.modified)]

    @property
    def fixed(self) -> tuple[int, ...]:
        """Channels that no design modifies."""
        return tuple(i for i in range(len(self.mosaic.channels)) if i not in self.modified)

    @property
    def longest_distance_dn(self) -> float:
        """No two points of the unclipped response that fit into the range are further apart; DN."""
        return float(2 * self.pixel.full_scale_dn * np.sqrt(len(self.mosaic.channels)))

    @property
    def members(self) -> dict[str, IndexArray]:
        """Signal type -> indices of its signals."""
        return self.lights.members


def signal_irradiance(setup: Setup) -> FloatArray:
    """Photon irradiance of each signal where its image is whole, on axis, in clear air, photons/s/m^2/nm.

    ndarray[n_signals, n_wavelengths].
    """
    scenario = setup.scenario
    factor = irradiance_factor(scenario.optics)
    luminance = scenario.luminance_cd_m2
    if luminance is None:
        return setup.lights.photons * (scenario.photon_radiance * factor)
    per_photon = luminance_per_photon_radiance(setup.grid, setup.lights.photons)
    return setup.lights.photons * (luminance / per_photon * factor)[:, None]


def white_irradiance(setup: Setup) -> FloatArray:
    """Photon irradiance of the white patch, flat in photons, ndarray[n_wavelengths]."""
    scenario, grid = setup.scenario, setup.grid
    ratio = setup.lights.photon_ratio
    if isinstance(scenario.exposure, WhitePatchExposure) and scenario.exposure.photon_ratio is not None:
        ratio = scenario.exposure.photon_ratio
    radiance = scenario.photon_radiance * irradiance_factor(scenario.optics)
    return np.full(grid.size, radiance / (ratio * grid.size * grid.step_nm))


def background_irradiance(setup: Setup) -> FloatArray:
    """Photon irradiance of the uniform background, flat in photons, ndarray[n_wavelengths]."""
    grid, luminance = setup.grid, setup.scenario.background_cd_m2
    if not luminance:
        return np.zeros(grid.size)
    flat = np.full((1, grid.size), 1 / (grid.size * grid.step_nm))
    radiance = luminance / luminance_per_photon_radiance(grid, flat)[0]
    return np.asarray(flat[0] * radiance * irradiance_factor(setup.scenario.optics), dtype=float)


def per_photon(setup: Setup) -> float:
    """Electrons per second, for each unit of sum over wavelengths of irradiance times QE: A FF dl."""
    return setup.grid.step_nm * setup.pixel.area_m2


def exposure_times(setup: Setup, modified_white: FloatArray) -> FloatArray:
    """Exposure of each design, s, ndarray[n_designs]; infinite where a white-patch exposure sees no light.

    `modified_white`: electrons/s of the modified channels on the white patch, ndarray[n_designs, n_modified].
    """
    exposure = setup.scenario.exposure
    if not isinstance(exposure, WhitePatchExposure):
        return np.full(len(modified_white), exposure.exposure_s)
    fixed = setup.qe[list(setup.fixed)] @ white_irradiance(setup) * per_photon(setup)
    brightest = np.maximum(modified_white.max(axis=1, initial=0.0), fixed.max(initial=0.0))
    full_e = exposure.level * setup.pixel.full_scale_dn / setup.pixel.dn_per_e
    found = np.full(len(brightest), np.inf)
    return np.asarray(np.divide(full_e, brightest, out=found, where=brightest > 0), dtype=float)
