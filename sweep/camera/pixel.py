"""Forward model of a uniform light: photon radiance -> irradiance -> electrons -> full well -> digital numbers."""

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
    """A lens without aberrations. `transmission` holds for all wavelengths.

    `focus_m`: distance that is in focus; null focuses on the target. `f_number`: 0.01 (no lens is faster than 0.5) to
    a million (a pinhole far away). `cra_deg`: the chief ray angle, at which the middle of the lens's cone of rays
    falls on the pixel; interference filters move with it.
    """

    f_number: float = Field(default=4.0, ge=0.01, le=1e6)
    focus_m: Meters | None = None
    transmission: Share = 1.0
    cra_deg: float = Field(default=0.0, ge=0, le=60)


class Pixel(Section):
    """A pixel and its readout.

    Defaults: 2.1 um pitch (AR0820), 12 bits, a full well of 10,000 e that maps to full scale. No `gain_dn_per_e` means
    full scale / full well. `offset_dn` is the pedestal. `crosstalk`: share of a pixel's light that comes through the
    filters of its four neighbors. `prnu`: relative standard deviation of the pixels' gains. Limits: a pitch of 1 nm to
    10 cm, wells of 0.001 to 1e7 e, gains of 1e-6 to 1e9 DN/e, read noise up to 10,000 e, dark current up to 1e15 e/s,
    PRNU up to 0.1.
    """

    pitch_um: float = Field(default=2.1, ge=1e-3, le=1e5)
    fill_factor: Share = 1.0
    well_e: WellE = 10_000.0
    bits: int = Field(default=12, ge=1, le=24)
    gain_dn_per_e: GainDnPerE | None = None
    offset_dn: NonNegative = 0.0
    crosstalk: float = Field(default=0.0, ge=0, lt=1)
    read_noise_e: ReadNoise = 0.0
    dark_e_per_s: DarkCurrent = 0.0
    prnu: Prnu = 0.0

    @model_validator(mode="after")
    def _pedestal_in_range(self) -> Pixel:
        if not self.offset_dn < self.full_scale_dn:
            raise ValueError(f"offset_dn {self.offset_dn:g} must be below full scale, {self.full_scale_dn}")
        return self

    @property
    def full_scale_dn(self) -> int:
        """The largest digital number, 4095 for 12 bits."""
        return int(2**self.bits - 1)

    @property
    def area_m2(self) -> float:
        """Light-sensitive area."""
        return (self.pitch_um * 1e-6) ** 2 * self.fill_factor

    @property
    def dn_per_e(self) -> float:
        """System gain, DN per electron."""
        return self.full_scale_dn / self.well_e if self.gain_dn_per_e is None else self.gain_dn_per_e

    @property
    def saturation_e(self) -> float:
        """Electrons from which the readout does not rise: the full well, or the end of the ADC's range."""
        return min(self.well_e, (self.full_scale_dn - self.offset_dn) / self.dn_per_e)


def irradiance_factor(optics: Optics, magnification: float = 0.0, field_angle_rad: float = 0.0) -> float:
    """Irradiance at the sensor over radiance of the scene, sr: pi T cos^4 / (1 + 4 N^2 (1 + |m|)^2).

    A distant scene has magnification 0. The form is ISETCam's; it is the camera equation without the small-aperture
    approximation.
    """
    cone = 1 + 4 * optics.f_number**2 * (1 + abs(magnification)) ** 2
    return math.pi * optics.transmission * math.cos(field_angle_rad) ** 4 / cone


def unquantized(electrons: FloatArray, pixel: Pixel) -> FloatArray:
    """The smooth response, DN: gain and pedestal without clipping or rounding."""
    return electrons * pixel.dn_per_e + pixel.offset_dn
