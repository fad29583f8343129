"""What is looked at: the chart's patches or a traffic light at a distance, under an exposure, in a weather."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from ..base.types import Meters, Ratio, Seconds, Section, Share
from .pixel import DarkCurrent, Optics, Pixel, Prnu, ReadNoise
from .sensor_field import SensorField

DIAMETER_M = 0.2
"""Diameter of a usual traffic light, EN 12368."""
OBJECT_RESOLUTION = "object_resolution_px"
"""Name of the quantity that a geometry gives."""


class WhitePatchExposure(Section):
    """The paper's exposure: the brightest channel on the white patch reaches `level` of full scale, per CFA.

    The white patch is flat in photons and fills the field, on axis in clear air; the level counts neither pedestal nor
    crosstalk, background or dark current. `photon_ratio` (K) is the photons of a signal patch over those of the white
    patch; null takes the data set's own, which for peak-normalized spectra is equivalent bandwidth / grid span.
    """

    kind: Literal["white_patch"] = "white_patch"
    level: Share = 0.95
    photon_ratio: Ratio | None = None


class FixedExposure(Section):
    """The same exposure time for every CFA, seconds: femtoseconds to 30 years."""

    kind: Literal["fixed"] = "fixed"
    exposure_s: Seconds


class Geometry(Section):
    """A traffic light of `diameter_m` at `distance_m`, seen by a sensor of `width_px` columns over `fov_deg`."""

    distance_m: Meters
    fov_deg: float = Field(ge=1e-6, le=360)
    width_px: int = Field(default=3840, ge=1, le=10_000_000)
    diameter_m: Meters = DIAMETER_M

    @property
    def object_resolution_px(self) -> float:
        """Pixels across the light, r_o = (width / FOV) 2 atan(d / 2D), uniform pixel density (the paper's Table 1)."""
        angle_deg = math.degrees(2 * math.atan(self.diameter_m / (2 * self.distance_m)))
        return self.width_px / self.fov_deg * angle_deg

    def focal_length_um(self, pitch_um: float) -> float:
        """Focal length that gives the pixels per radian, micrometers."""
        return pitch_um * self.width_px / math.radians(self.fov_deg)


_FARTHEST_PX = 1e9
"""The mosaic repeats after a few pixels; of larger numbers a float keeps less and less of a pixel."""
_PlacePx = Annotated[
    list[Annotated[float, Field(ge=-_FARTHEST_PX, le=_FARTHEST_PX)]], Field(min_length=2, max_length=2)
]


def _place(value: Any) -> Any:
    """`any`, or two finite numbers."""
    if value == "any":
        return value
    numbers = list(value) if isinstance(value, list | tuple) else []
    plain = all(isinstance(v, int | float) and not isinstance(v, bool) for v in numbers)
    if len(numbers) != 2 or not plain or not all(abs(v) <= _FARTHEST_PX for v in numbers):
        raise ValueError(f"a place is `any`, or [column, row] in pixels, each -{_FARTHEST_PX:g} to {_FARTHEST_PX:g}")
    return (float(numbers[0]), float(numbers[1]))


class Target(Geometry):
    """A traffic light as a disc on the sensor.

    `phase_px`: where its center falls, in pixels from the center of the tile's first pixel (column, row); `any` asks
    for the worst of all places. `readout`: `mean` of each channel's pixels over the disc, weighted by how much of each
    the disc covers (over at least the radius in which every channel has a pixel), or the demosaicked pixel at the
    `center`.
    """

    phase_px: Annotated[
        Literal["any"] | tuple[float, float], BeforeValidator(_place, json_schema_input_type=Literal["any"] | _PlacePx)
    ] = (0.0, 0.0)
    readout: Literal["mean", "center"] = "mean"


class Drive(Section):
    """A pulsed LED: on for `duty` of each period; its mean intensity is the rated one."""

    duty: Share
    frequency_hz: float = Field(ge=1e-6, le=1e12)


class VeilingGlare(Section):
    """Light that the lens spreads evenly over the field: a `share` of its mean, which is then missing in the image.

    `field_cd_m2`: mean luminance of the whole field, flat in photons; left out, that of the background.
    """

    share: Share
    field_cd_m2: float | None = Field(default=None, ge=0, le=1e15)


class Noise(Section):
    """Photon, read and dark noise and PRNU of the study's pixel; what is given here replaces the pixel's figure."""

    read_noise_e: ReadNoise | None = None
    dark_e_per_s: DarkCurrent | None = None
    prnu: Prnu | None = None

    def of(self, pixel: Pixel) -> Pixel:
        """The pixel with this noise."""
        return pixel.model_copy(update=self.model_dump(exclude_none=True))


def _noise(value: Any) -> Any:
    """`true` is the pixel's own noise, `false` none."""
    if isinstance(value, bool):
        return {} if value else None
    if value is None or isinstance(value, dict | Noise):
        return value
    raise PydanticCustomError("bool_type", "true, false or a mapping")


class Scene(Section):
    """What the camera sees, and how it is exposed: a scenario of a study.

    Without a `target` every signal is a self-emissive patch that fills the field. Signals have the same photon count,
    `photon_radiance` (photons/s/sr/m^2, summed over the wavelength grid), or, with `intensity_cd`, the luminance of a
    light of that luminous intensity and the target's diameter (0.2 m without a target). `background_cd_m2`: light that
    is added over the whole field, also in front of the target, flat in photons. `drive`: of a pulsed LED. `field`: the
    worst place of the sensor. `off_axis_deg`: the field angle, off which a lens without vignetting gives cos^4 of the
    light. `visibility_m`: the distance at which haze or fog leaves 2 % of a target's light (Koschmieder's
    meteorological range). `veiling_glare`: light that the lens spreads over the field. `noise`: photon, read and dark
    noise and PRNU act before the mean is taken; true, or figures of its own. Limits: 1 to 1e40 photons (the sun's disc:
    1e25), 1e-12 to 1e15 cd, a background up to 1e15 cd/m^2 (the sun: 2e9).
    """

    photon_radiance: float = Field(default=2e18, ge=1, le=1e40)
    intensity_cd: float | None = Field(default=None, ge=1e-12, le=1e15)
    exposure: Annotated[WhitePatchExposure | FixedExposure, Field(discriminator="kind")] = WhitePatchExposure()
    optics: Optics = Optics()
    target: Target | None = None
    background_cd_m2: float = Field(default=0.0, ge=0, le=1e15)
    drive: Drive | None = None
    field: SensorField | None = None
    off_axis_deg: float = Field(default=0.0, ge=0, lt=90)
    visibility_m: Meters | None = None
    veiling_glare: VeilingGlare | None = None
    noise: Annotated[Noise | None, BeforeValidator(_noise, json_schema_input_type=bool | Noise | None)] = None

    @model_validator(mode="after")
    def _goes_together(self) -> Scene:
        if self.intensity_cd is not None and isinstance(self.exposure, WhitePatchExposure):
            raise ValueError("intensity_cd needs a fixed exposure: the white patch is given in photons")
        if self.field is not None and self.optics.cra_deg:
            raise ValueError("`field` says the chief ray angle of each place: leave out optics.cra_deg")
        if self.field is not None and self.target is not None and self.target.phase_px == "any":
            raise ValueError("`field` needs a light at a named place of the mosaic, not `phase_px: any`")
        if self.visibility_m is not None and self.target is None:
            raise ValueError("visibility_m needs a target with a distance")
        if self.veiling_glare is not None and self.target is None:
            raise ValueError("veiling_glare needs a target: of a light that fills the field it takes nothing")
        return self

    @property
    def any_phase(self) -> bool:
        """True where the light may fall anywhere on the mosaic."""
        return self.target is not None and self.target.phase_px == "any"

    @property
    def luminance_cd_m2(self) -> float | None:
        """Luminance of a signal, L = I / (pi d^2 / 4) (EN 12368's round signal); None for equal photons."""
        if self.intensity_cd is None:
            return None
        diameter = DIAMETER_M if self.target is None else self.target.diameter_m
        return self.intensity_cd / (math.pi * diameter**2 / 4)
