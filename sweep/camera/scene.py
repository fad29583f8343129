"""Scene: chart patches or a traffic light at a distance, with exposure and weather."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from ..base.types import Meters, Ratio, Seconds, Section, Share, from_to
from .captures import ReadNoise
from .pixel import DarkCurrent, Optics, Pixel, Prnu
from .sensor_field import SensorField

DIAMETER_M = 0.2
"""Diameter of a usual traffic light, EN 12368."""
OBJECT_RESOLUTION = "object_resolution_px"
"""Name of the quantity that a geometry gives."""


_Brightness = Annotated[float, Field(ge=0, le=1e12)]


class WhitePatchExposure(Section):
    """Exposure time set per CFA, so that the brightest channel on a white patch reaches `level` of full scale.

    The white patch is flat in photons and fills the field, on axis in clear air. The level counts neither pedestal nor
    crosstalk, background or dark current.
    """

    kind: Literal["white_patch"] = "white_patch"
    """`white_patch`."""
    level: Share = 0.95
    """Share of full scale."""
    photon_ratio: Ratio | None = None
    """Photons of a signal patch over those of the white patch; left out, that of the lights: equivalent bandwidth over
    the span of the grid for peak-normalized spectra."""


class FixedExposure(Section):
    """The same exposure time for every CFA."""

    kind: Literal["fixed"] = "fixed"
    """`fixed`."""
    exposure_s: Seconds
    """Exposure time, s."""


class Geometry(Section):
    """A traffic light seen by a sensor."""

    distance_m: Meters
    """Distance, m."""
    fov_deg: float = Field(ge=1e-6, le=360)
    """Horizontal field of view, degrees."""
    width_px: int = Field(default=3840, ge=1, le=10_000_000)
    """Columns of the sensor."""
    diameter_m: Meters = DIAMETER_M
    """Diameter of the light, m."""

    @property
    def object_resolution_px(self) -> float:
        """Pixels across the light, r_o = (width / FOV) 2 atan(d / 2D), at uniform pixel density (paper, Table 1)."""
        angle_deg = math.degrees(2 * math.atan(self.diameter_m / (2 * self.distance_m)))
        return self.width_px / self.fov_deg * angle_deg

    def focal_length_um(self, pitch_um: float) -> float:
        """Return the focal length that gives the pixels per radian."""
        return pitch_um * self.width_px / math.radians(self.fov_deg)


_FARTHEST_PX = 1e9
"""The mosaic repeats after a few pixels; of larger numbers a float keeps less and less of a pixel."""
_PlacePx = Annotated[
    list[Annotated[float, Field(ge=-_FARTHEST_PX, le=_FARTHEST_PX)]], Field(min_length=2, max_length=2)
]


def _place(value: Any) -> Any:
    """Check `any` or two finite numbers."""
    if value == "any":
        return value
    numbers = list(value) if isinstance(value, list | tuple) else []
    plain = all(isinstance(v, int | float) and not isinstance(v, bool) for v in numbers)
    if len(numbers) != 2 or not plain or not all(abs(v) <= _FARTHEST_PX for v in numbers):
        raise ValueError(
            f"a sampling phase is `any`, or [column, row] in pixels, each -{_FARTHEST_PX:g} to {_FARTHEST_PX:g}"
        )
    return (float(numbers[0]), float(numbers[1]))


class Target(Geometry):
    """A traffic light as a uniform disc on the sensor."""

    phase_px: Annotated[
        Literal["any"] | tuple[float, float], BeforeValidator(_place, json_schema_input_type=Literal["any"] | _PlacePx)
    ] = (0.0, 0.0)
    """Sampling phase: center of the light as (column, row), pixels from the center of the tile's first pixel; `any`:
    the worst of all phases."""
    readout: Literal["mean", "center"] = "mean"
    """`mean`: mean of each channel's pixels over the disc, weighted by the share of each that the disc covers (over at
    least the radius in which every channel has a pixel); `center`: the demosaicked pixel at the center."""


class PwmDrive(Section):
    """A pulsed LED (PWM); its mean intensity is the rated one."""

    duty: Share
    """Share of each period in which the LED is on."""
    frequency_hz: float = Field(ge=1e-6, le=1e12)
    """Frequency of the pulses, Hz."""


class VeilingGlare(Section):
    """Light that the lens spreads evenly over the field, and that is missing in the image."""

    share: Share
    """Share of the mean light of the field."""
    field_cd_m2: float | None = Field(default=None, ge=0, le=1e15)
    """Mean luminance of the whole field, flat in photons, cd/m2; left out, that of the background."""


class Noise(Section):
    """Photon, read and dark noise and PRNU; figures given here replace those of the study's pixel."""

    read_noise_e: ReadNoise | None = None
    """Read noise, electrons (standard deviation)."""
    dark_e_per_s: DarkCurrent | None = None
    """Dark current, electrons per second."""
    prnu: Prnu | None = None
    """Relative standard deviation of the pixels' gains."""

    def of(self, pixel: Pixel) -> Pixel:
        """Return a pixel with this noise.

        Returns the pixel with the figures that are given here.
        """
        return pixel.model_copy(update=self.model_dump(exclude_none=True))


def _noise(value: Any) -> Any:
    """Convert true to the pixel's own noise, and false to none."""
    if isinstance(value, bool):
        return {} if value else None
    if value is None or isinstance(value, dict | Noise):
        return value
    raise PydanticCustomError("bool_type", "true, false or a mapping")


class Scene(Section):
    """Scene and exposure: a scenario of a study.

    Without a `target` every signal is a self-emissive patch that fills the field.
    """

    photon_radiance: float = Field(default=2e18, ge=1, le=1e40)
    """Radiance of every signal, photons/s/sr/m2, summed over the wavelength grid."""
    intensity_cd: float | None = Field(default=None, ge=1e-12, le=1e15)
    """Luminous intensity of every signal instead of equal photons, cd; its luminance follows from the target's diameter
    (0.2 m without a target)."""
    brightness: Annotated[tuple[_Brightness, _Brightness] | None, BeforeValidator(from_to)] = None
    """Least and most brightness of the other lamp in chromatic figures, relative to the scene's; left out, from dark to
    beyond saturation."""
    exposure: Annotated[WhitePatchExposure | FixedExposure, Field(discriminator="kind")] = WhitePatchExposure()
    """Exposure time, set by a white patch or fixed."""
    optics: Optics = Optics()
    """Lens."""
    target: Target | None = None
    """Traffic light at a distance."""
    background_cd_m2: float = Field(default=0.0, ge=0, le=1e15)
    """Luminance that is added over the whole field, also in front of the target, flat in photons, cd/m2."""
    drive: PwmDrive | None = None
    """Pulsed LED."""
    pixel: Pixel | None = None
    """Numbers of the pixel that this scenario has otherwise than the study's `pixel` (`{bits: 10}`); pixels of other
    captures are `pixels` of a study."""
    field: SensorField | None = None
    """Field positions, of which the worst counts."""
    off_axis_deg: float = Field(default=0.0, ge=0, lt=90)
    """Field angle, degrees; a lens without vignetting transmits cos^4 of the light."""
    visibility_m: Meters | None = None
    """Meteorological visibility, m: haze or fog leaves 2 % of a target's light (Koschmieder)."""
    veiling_glare: VeilingGlare | None = None
    """Light that the lens spreads over the field."""
    noise: Annotated[Noise | None, BeforeValidator(_noise, json_schema_input_type=bool | Noise | None)] = None
    """Photon, read and dark noise and PRNU, before the mean is taken: true, or figures of its own."""
    series: str = ""
    """The scenario whose `each` made this one; stated by a run."""
    at: dict[str, float] = {}
    """Values of `each` that made this scenario, by dotted key; stated by a run."""

    def __hash__(self) -> int:
        return hash(self.model_dump_json())

    def pixel_of(self, pixel: Pixel) -> Pixel:
        """Return the pixel of a study with the numbers and the noise of this scene."""
        of_scene = pixel if self.pixel is None else self.pixel
        return of_scene if self.noise is None else self.noise.of(of_scene)

    @property
    def equal_photons(self) -> bool:
        """True if all signals send the same number of photons, so that a CSD does not count how bright a lamp is."""
        return self.intensity_cd is None and self.drive is None

    @model_validator(mode="after")
    def _goes_together(self) -> Scene:
        if self.brightness is not None and not self.brightness[0] <= self.brightness[1]:
            raise ValueError(f"brightness: {self.brightness[0]:g} must be at most {self.brightness[1]:g}")
        if self.intensity_cd is not None and isinstance(self.exposure, WhitePatchExposure):
            raise ValueError("intensity_cd needs a fixed exposure: the white patch is given in photons")
        if self.field is not None and self.optics.cra_deg:
            raise ValueError("`field` says the chief ray angle of each field position: leave out optics.cra_deg")
        if self.field is not None and self.target is not None and self.target.phase_px == "any":
            raise ValueError("`field` needs a named sampling phase, not `phase_px: any`")
        if self.visibility_m is not None and self.target is None:
            raise ValueError("visibility_m needs a target with a distance")
        if self.veiling_glare is not None and self.target is None:
            raise ValueError("veiling_glare needs a target: of a light that fills the field it takes nothing")
        return self

    @property
    def any_phase(self) -> bool:
        """True if the worst sampling phase counts."""
        return self.target is not None and self.target.phase_px == "any"

    @property
    def luminance_cd_m2(self) -> float | None:
        """Luminance of a signal, L = I / (pi d^2 / 4) (round signal of EN 12368); None for equal photons."""
        if self.intensity_cd is None:
            return None
        diameter = DIAMETER_M if self.target is None else self.target.diameter_m
        return self.intensity_cd / (math.pi * diameter**2 / 4)
