"""Pixel and lens of a camera, and the readout of a uniform light."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from ..base.types import Array, Float, Meters, NonNegative, SameShape, Section, Share, from_to
from .captures import (
    MOST_CAPTURES,
    Bits,
    Capture,
    CaptureNames,
    Crosstalk,
    Exposure,
    GainDnPerE,
    Merge,
    ReadNoise,
    WellE,
    as_tuple,
    named_captures,
)

DarkCurrent = Annotated[float, Field(ge=0, le=1e15)]
"""Electrons per second; any well is full in less than a second."""

DEFAULT_PITCH_UM = 2.1
MOST_PRNU = 0.1
"""Largest relative deviation of gains: a Gaussian gain is then positive within ten of them. Sensors have 0.01."""
Prnu = Annotated[float, Field(ge=0, le=MOST_PRNU)]
_Captures = Annotated[list[Capture], Field(max_length=MOST_CAPTURES)]
_MOST_FULL_E = 1e9
"""Largest light of a pixel of full sensitivity that the captures tell apart, electrons, which are tabulated."""
_MOST_WELL_E = 1e6
"""Largest full well of a capture, electrons, which are counted one by one."""
_Knee = Annotated[tuple[NonNegative, NonNegative], BeforeValidator(from_to)]


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

    pitch_um: float = Field(default=DEFAULT_PITCH_UM, ge=1e-3, le=1e5)
    """Pixel pitch, micrometers."""
    fill_factor: Share = 1.0
    """Light-sensitive share of the pixel's area."""
    well_e: WellE = 10_000.0
    """Full well, electrons."""
    well_e_per_um2: Annotated[float, Field(ge=1e-6, le=1e9)] | None = None
    """Full well per area of the pixel, electrons/um2, instead of `well_e`: it grows with the square of the pitch."""
    bits: Bits = 12
    """Bits of the ADC."""
    gain_dn_per_e: GainDnPerE | None = None
    """Gain, DN per electron; left out, full scale over full well."""
    offset_dn: NonNegative = 0.0
    """Black level (pedestal), DN."""
    crosstalk: Crosstalk = 0.0
    """Share of a pixel's light that comes through the filters of its four neighbors."""
    read_noise_e: ReadNoise = 0.0
    """Read noise, electrons (standard deviation)."""
    dark_e_per_s: DarkCurrent = 0.0
    """Dark current, electrons per second."""
    prnu: Prnu = 0.0
    """Photo response non-uniformity: relative standard deviation of the pixels' gains, which its captures share."""
    captures: Annotated[
        tuple[Capture, ...],
        Field(max_length=MOST_CAPTURES),
        BeforeValidator(named_captures, json_schema_input_type=CaptureNames | _Captures),
    ] = ()
    """Readouts of an HDR pixel, from the most sensitive to the least; or `split_pixel`, `dual_gain`, `staggered`.
    DN are then those of the first one; the merged value goes beyond its full scale."""
    merge: Merge = "saturated"
    """`saturated`: the most sensitive capture below its threshold; `weighted`: the mean of all below theirs, weighted
    by the inverse variances at the expected light, with photon noise shared within an exposure."""
    threshold: Share = 0.9
    """Share of saturation from which on a capture is not used; the least sensitive one always is."""
    companding: Annotated[tuple[_Knee, ...], BeforeValidator(as_tuple, json_schema_input_type=list[_Knee])] = ()
    """Knees of the code that the merged value is stored in: [DN of the merged value, code], from [0, 0] on."""

    @model_validator(mode="before")
    @classmethod
    def _with_well(cls, value: Any) -> Any:
        """Return the keys with the full well that follows from the pitch."""
        density = value.get("well_e_per_um2") if isinstance(value, dict) else None
        pitch_um = value.get("pitch_um", DEFAULT_PITCH_UM) if isinstance(value, dict) else None
        well = 0.0 if not isinstance(value, dict) else value.get("well_e", 0.0)
        if not all(isinstance(number, int | float) for number in (density, pitch_um, well)):
            return value
        well_e = float(density) * float(pitch_um) ** 2  # type: ignore[arg-type]
        if "well_e" in value and not math.isclose(value["well_e"], well_e, rel_tol=1e-9):
            raise ValueError(f"well_e_per_um2 gives well_e {well_e:g}: leave one of both out")
        return {**value, "well_e": well_e}

    @model_validator(mode="after")
    def _consistent(self) -> Pixel:
        for number, pixel in enumerate(self.read_as or (self,)):
            if not pixel.offset_dn < pixel.full_scale_dn:
                where = f"captures.{number}: " if self.captures else ""
                raise ValueError(f"{where}offset_dn {self.offset_dn:g} must be below full scale, {pixel.full_scale_dn}")
            if self.captures and pixel.well_e > _MOST_WELL_E:
                raise ValueError(f"captures.{number}: well_e {pixel.well_e:g} is above {_MOST_WELL_E:,.0f} electrons")
        if self.companding and not self.captures:
            raise ValueError("companding needs captures")
        slopes = [capture.light * pixel.dn_per_e for capture, pixel in zip(self.captures, self.read_as, strict=True)]
        for number in range(1, len(slopes)):
            if slopes[number] > slopes[number - 1] * (1 + 1e-9):
                raise ValueError(f"captures.{number} is more sensitive (DN per photon) than the one before it")
        if not self.crosstalk and any(capture.crosstalk for capture in self.captures):
            raise ValueError("crosstalk of a capture needs a crosstalk of the pixel above 0")
        if (np.diff(self.knees) <= 0).any():
            raise ValueError("companding: knees must ascend in DN and in code, from above 0")
        for number, (capture, pixel) in enumerate(zip(self.captures, self.read_as, strict=True)):
            certain_e = pixel.saturation_e + 100 + 10 * math.sqrt(pixel.saturation_e + pixel.read_noise_e**2)
            if (full_e := certain_e / (capture.light * min([1.0, *capture.qe_factor.values()]))) > _MOST_FULL_E:
                problem = f"is full for certain where a pixel of full sensitivity has {full_e:.3g} electrons"
                raise ValueError(f"captures.{number} {problem}; allowed: at most {_MOST_FULL_E:.0e}")
        top_dn = self.saturation_e * self.dn_per_e + self.offset_dn
        if self.companding and self.knees[0, -1] < top_dn * (1 - 1e-9):
            raise ValueError(f"companding: the last knee must be at {top_dn:.6g} DN or more, where all are saturated")
        return self

    def with_numbers(self, changes: Mapping[str, Any]) -> dict[str, Any]:
        """Return the keys of the pixel with some of them replaced; see `merged`."""
        keys = self.model_dump(exclude_unset=True)
        if self.well_e_per_um2 is not None:
            keys.pop("well_e", None)
        return merged(keys, changes)

    @property
    def knees(self) -> Float[Array, "2 knees"]:
        """DN of the merged value, and codes, at 0 and at each knee."""
        return np.array([(0.0, 0.0), *self.companding]).T

    @property
    def read_as(self) -> tuple[Pixel, ...]:
        """Each capture as a pixel that is read once."""
        return _read_as(self)

    @property
    def read_once(self) -> Pixel:
        """The pixel of full sensitivity whose DN are those of the merged value."""
        return self.model_copy(update={"captures": (), "companding": (), "gain_dn_per_e": self.dn_per_e})

    @property
    def exposures(self) -> tuple[Exposure, ...]:
        """Electrons that captures read, each once, in the order of their most sensitive captures."""
        groups: dict[object, list[int]] = {}
        for number, capture in enumerate(self.captures):
            groups.setdefault(capture.electrons_key, []).append(number)
        return tuple(Exposure(self.captures[numbers[0]], tuple(numbers)) for numbers in groups.values())

    @property
    def full_scale_dn(self) -> int:
        """Largest digital number, 4095 for 12 bits; of an HDR pixel that of its first capture."""
        return self.read_as[0].full_scale_dn if self.captures else int(2**self.bits - 1)

    @property
    def area_m2(self) -> float:
        """Light-sensitive area, m2."""
        return (self.pitch_um * 1e-6) ** 2 * self.fill_factor

    @property
    def dn_per_e(self) -> float:
        """Gain, DN per electron (the inverse of the conversion gain).

        That of an HDR pixel is DN of its first capture per electron of a pixel of full sensitivity.
        """
        if self.captures:
            return self.read_as[0].dn_per_e * self.captures[0].light
        return self.full_scale_dn / self.well_e if self.gain_dn_per_e is None else self.gain_dn_per_e

    @property
    def saturation_e(self) -> float:
        """Electrons at saturation: the full well, or the end of the range of the ADC; of an HDR pixel, of all."""
        if self.captures:
            return max(capture.saturation_e / of.light for capture, of in zip(self.read_as, self.captures, strict=True))
        return min(self.well_e, (self.full_scale_dn - self.offset_dn) / self.dn_per_e)


def merged(keys: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keys of a pixel with some of them replaced; a full well replaces its density, and the other way."""
    wells = {"well_e", "well_e_per_um2"}
    gone = {name for name in wells & keys.keys() if wells & changes.keys() - {name}}
    return {**{key: value for key, value in keys.items() if key not in gone}, **changes}


@lru_cache(maxsize=64)
def _read_as(pixel: Pixel) -> tuple[Pixel, ...]:
    once = {"captures": (), "companding": ()}
    names = ("well_e", "gain_dn_per_e", "read_noise_e", "bits")
    given = [{n: v for n in names if (v := getattr(capture, n)) is not None} for capture in pixel.captures]
    return tuple(pixel.model_copy(update=once | figures) for figures in given)


def irradiance_factor(optics: Optics, magnification: float = 0.0) -> float:
    """Return the ratio of irradiance on the sensor to radiance of the scene, sr.

    pi T / (1 + 4 N^2 (1 + |m|)^2) on axis, the camera equation without the small-aperture approximation, as in ISETCam.

    `magnification`: 0 for a distant scene.
    """
    cone = 1 + 4 * optics.f_number**2 * (1 + abs(magnification)) ** 2
    return math.pi * optics.transmission / cone


def unquantized(electrons: SameShape, pixel: Pixel) -> SameShape:
    """Apply gain and pedestal without clipping or rounding; returns DN."""
    return np.asarray(electrons * pixel.dn_per_e + pixel.offset_dn)
