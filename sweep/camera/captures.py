"""Captures of an HDR pixel: readouts of its photodiodes and exposures, which are merged to one value."""

from __future__ import annotations

from typing import Annotated, Any, Literal, NamedTuple

from pydantic import Field

from ..base.types import Ratio, Section, Share

MOST_CAPTURES = 4
Crosstalk = Annotated[float, Field(ge=0, lt=1)]
ReadNoise = Annotated[float, Field(ge=0, le=1e4)]
"""Electrons; sensors have 1 to 100."""
WellE = Annotated[float, Field(ge=1e-3, le=1e7)]
"""Ten million electrons are more than pixels for visible light hold."""
GainDnPerE = Annotated[float, Field(ge=1e-6, le=1e9)]
Bits = Annotated[int, Field(ge=1, le=24)]
Merge = Literal["saturated", "weighted"]
CaptureNames = Literal["split_pixel", "dual_gain", "staggered"]


class Capture(Section):
    """One readout of an HDR pixel; what is left out is as in the pixel.

    Captures of equal sensitivity, exposure, start, QE and crosstalk read the same electrons, as those of dual
    conversion gain do.
    """

    sensitivity: Share = 1.0
    """Light of its photodiode relative to the pixel's; its dark current is in proportion."""
    exposure_ratio: Share = 1.0
    """Exposure time relative to the scene's."""
    start_ratio: Annotated[float, Field(ge=0, le=1e6)] = 0.0
    """Start of its exposure after the first one's, relative to the scene's exposure time."""
    qe_factor: dict[str, Ratio] = {}
    """Channel -> QE of its photodiode relative to the pixel's."""
    crosstalk: Crosstalk | None = None
    """Share of its light that comes through the filters of the four neighbors."""
    well_e: WellE | None = None
    """Full well, electrons."""
    gain_dn_per_e: GainDnPerE | None = None
    """Gain, DN per electron; left out, full scale over full well."""
    read_noise_e: ReadNoise | None = None
    """Read noise, electrons (standard deviation)."""
    bits: Bits | None = None
    """Bits of its ADC."""

    def __hash__(self) -> int:
        return hash((self.sensitivity, self.exposure_ratio, self.start_ratio, self.well_e, self.bits))

    @property
    def light(self) -> float:
        """Electrons relative to those of a pixel of full sensitivity in the scene's exposure time."""
        return self.sensitivity * self.exposure_ratio

    @property
    def electrons_key(self) -> tuple[Any, ...]:
        """Equal for captures that read the same electrons."""
        qe = tuple(sorted(self.qe_factor.items()))
        return self.sensitivity, self.exposure_ratio, self.start_ratio, qe, self.crosstalk


class Exposure(NamedTuple):
    """Electrons that one or more captures read."""

    capture: Capture
    numbers: tuple[int, ...]


_LARGE_E, _LARGE_UV, _HIGH_UV = 22_000.0, 49.0, 200.0
_LARGE = (
    Capture(well_e=_LARGE_E * _LARGE_UV / _HIGH_UV, read_noise_e=0.83),
    Capture(well_e=_LARGE_E, read_noise_e=3.05),
)
NAMED_CAPTURES: dict[str, tuple[Capture, ...]] = {
    "split_pixel": (*_LARGE, Capture(sensitivity=0.01, well_e=7_900.0, read_noise_e=0.83)),
    "dual_gain": _LARGE,
    "staggered": (
        Capture(),
        Capture(exposure_ratio=1 / 16, start_ratio=1.0),
        Capture(exposure_ratio=1 / 256, start_ratio=1 + 1 / 16),
    ),
}
"""`split_pixel`: a large photodiode with 22,000 e, read at 200 and 49 uV/e, and a small one with 1/100 of its light and
7,900 e (Solhusvik et al., International Image Sensor Workshop 2019, 2.8 um; the swing of the large one at 200 uV/e is
taken to be that at 49 uV/e). `dual_gain`: its large photodiode alone. `staggered`: three exposures one after the other,
16 times shorter each."""


def as_tuple(value: Any) -> Any:
    """Convert a list to a tuple, and leave anything else."""
    return tuple(value) if isinstance(value, list) else value


def named_captures(value: Any) -> Any:
    """Look up a name, and convert a list to a tuple.

    `value`: name of a pixel, or captures. Raises ValueError if there is no pixel of this name.
    """
    if isinstance(value, str):
        if value not in NAMED_CAPTURES:
            raise ValueError(f"captures are a list, or one of {', '.join(NAMED_CAPTURES)}")
        return NAMED_CAPTURES[value]
    return as_tuple(value)
