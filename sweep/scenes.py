"""What is looked at: the chart's patches under an exposure, and the geometry of a traffic light at a distance."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field

from .schema import Positive, Section
from .sensor import Optics

OBJECT_RESOLUTION = "object_resolution_px"
"""Name of the quantity that a geometry gives."""


class WhitePatchExposure(Section):
    """The paper's exposure: the brightest channel on the white patch reaches `level` of full scale, per CFA.

    The white patch is flat in photons. `photon_ratio` (K) is the photons of a signal patch over those of the white
    patch; null takes the data set's own, which for peak-normalized spectra is equivalent bandwidth / grid span.
    """

    kind: Literal["white_patch"] = "white_patch"
    level: float = Field(default=0.95, gt=0, le=1)
    photon_ratio: float | None = Field(default=None, gt=0)


class FixedExposure(Section):
    """The same exposure time for every CFA, seconds."""

    kind: Literal["fixed"] = "fixed"
    exposure_s: Positive


class Scenario(Section):
    """Every signal as a self-emissive patch that fills the field, all with the same photon count.

    `photon_radiance`: photons/s/sr/m^2 of each signal, summed over the wavelength grid.
    """

    photon_radiance: Positive = 2e18
    exposure: Annotated[WhitePatchExposure | FixedExposure, Field(discriminator="kind")] = WhitePatchExposure()
    optics: Optics = Optics()


class Geometry(Section):
    """A traffic light of `diameter_m` at `distance_m`, seen by a sensor of `width_px` columns over `fov_deg`."""

    distance_m: Positive
    fov_deg: float = Field(gt=0, le=360)
    width_px: int = Field(default=3840, ge=1)
    diameter_m: Positive = 0.2

    @property
    def object_resolution_px(self) -> float:
        """Pixels across the light, r_o = (width / FOV) 2 atan(d / 2D), uniform pixel density (the paper's Table 1)."""
        angle_deg = math.degrees(2 * math.atan(self.diameter_m / (2 * self.distance_m)))
        return self.width_px / self.fov_deg * angle_deg
