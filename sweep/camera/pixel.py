"""Pixel and lens of a camera, and the readout of a uniform light."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field, model_validator

from ..base.types import FloatArray, Meters, NonNegative, Section, Share

ReadNoise = Annotated[float, Field(ge=0, le=1e4)]
"""Electrons; sensors have 1 to 100."""
DarkCurrent = Annotated[float, Field(ge=0, le=1e15)]
"""Electrons per second; any well is full in less than a second."""

MOST_PRNU = 0.1
"""Largest relative deviation of gains: a Gaussian gain is then positive within ten of them. Sensors have 0.01."""
Prnu = Annotated[float, Field(ge=0, le=MOST_PRNU)]
WellE = Annotated[float, Field(ge=1e-3, le=1e7)]
"""Ten million electrons are more than pixels for visible light hold."""
GainDnPerE = Annotated[float, Field(ge=1e-6, le=1e9)]


class Optics(Section):
    """A lens without aberrations."""

    f_number: float = Field(default=4.0, ge=0.01, le=1e6)
    """f-number."""
    focus_m: Meters | None = None
    """Distance that is in focus, m; left out, that of the target."""
    transmission: Share = 1.0
    """Transmission at all wavelengths."""
    cra_deg: float = Field(default=0.0, ge=0, le=60)
    """Chief ray angle, degrees; interference filters move with it."""


class Pixel(Section):
    """A pixel and its readout; the defaults are those of an AR0820 with 12 bits."""

    pitch_um: float = Field(default=2.1, ge=1e-3, le=1e5)
    """Pixel pitch, micrometers."""
    fill_factor: Share = 1.0
    """Light-sensitive share of the pixel's area."""
    well_e: WellE = 10_000.0
    """Full well, electrons."""
    bits: int = Field(default=12, ge=1, le=24)
    """Bits of the ADC."""
    gain_dn_per_e: GainDnPerE | None = None
    """Gain, DN per electron; left out, full scale over full well."""
    offset_dn: NonNegative = 0.0
    """Black level (pedestal), DN."""
    crosstalk: float = Field(default=0.0, ge=0, lt=1)
    """Share of a pixel's light that comes through the filters of its four neighbors."""
    read_noise_e: ReadNoise = 0.0
    """Read noise, electrons (standard deviation)."""
    dark_e_per_s: DarkCurrent = 0.0
    """Dark current, electrons per second."""
    prnu: Prnu = 0.0
    """Photo response non-uniformity: relative standard deviation of the pixels' gains."""

    @model_validator(mode="after")
    def _pedestal_in_range(self) -> Pixel:
        if not self.offset_dn < self.full_scale_dn:
            raise ValueError(f"offset_dn {self.offset_dn:g} must be below full scale, {self.full_scale_dn}")
        return self

    @property
    def full_scale_dn(self) -> int:
        """Largest digital number, 4095 for 12 bits."""
        return int(2**self.bits - 1)

    @property
    def area_m2(self) -> float:
        """Light-sensitive area, m2."""
        return (self.pitch_um * 1e-6) ** 2 * self.fill_factor

    @property
    def dn_per_e(self) -> float:
        """Gain, DN per electron (the inverse of the conversion gain)."""
        return self.full_scale_dn / self.well_e if self.gain_dn_per_e is None else self.gain_dn_per_e

    @property
    def saturation_e(self) -> float:
        """Electrons at saturation: the full well, or the end of the range of the ADC."""
        return min(self.well_e, (self.full_scale_dn - self.offset_dn) / self.dn_per_e)


def irradiance_factor(optics: Optics, magnification: float = 0.0, field_angle_rad: float = 0.0) -> float:
    """Return the ratio of irradiance on the sensor to radiance of the scene.

    pi T cos^4 / (1 + 4 N^2 (1 + |m|)^2), the camera equation without the small-aperture approximation, as in ISETCam.

    Parameters
    ----------
    optics : Optics
        f-number and transmission.
    magnification : float
        0 for a distant scene.
    field_angle_rad : float
        Field angle, rad.

    Returns
    -------
    float
        Ratio, sr.
    """
    cone = 1 + 4 * optics.f_number**2 * (1 + abs(magnification)) ** 2
    return math.pi * optics.transmission * math.cos(field_angle_rad) ** 4 / cone


def unquantized(electrons: FloatArray, pixel: Pixel) -> FloatArray:
    """Apply gain and pedestal without clipping or rounding.

    Parameters
    ----------
    electrons : ndarray
        Electrons.
    pixel : Pixel
        Gain and pedestal.

    Returns
    -------
    ndarray of the same shape
        Digital numbers, DN.
    """
    return electrons * pixel.dn_per_e + pixel.offset_dn
