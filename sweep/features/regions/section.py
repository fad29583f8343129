"""Single LEDs that a norm allows: all peaks and widths with a color in its region of yellow or red."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from ...base.errors import Fault
from ...base.types import Array, Float, Section, from_to
from ...spectra.builtin.led import led_photons
from ...spectra.color import SIGNAL_REGIONS, chromaticity
from ...spectra.signal_color import VISIBLE
from ...spectra.spectrum import WavelengthGrid, equal_photons

if TYPE_CHECKING:
    from ...study import StudySection
    from ...study.checks import Checked

Norm = Literal["en_12368", "ite", "un_r48"]
_FWHM = 2 * math.log(2 + math.sqrt(3))
"""Full width at half maximum of sech(u / a), in units of a."""
_MOST_LEDS = 20_000


_Peak = Annotated[float, Field(ge=400, le=780)]
_Width = Annotated[float, Field(ge=5, le=100)]


class RegionMap(Section):
    """Lamps of a norm that a camera cannot separate: all yellow and red LEDs in its color regions.

    An LED is modeled as a hyperbolic secant with a peak and a width. LEDs whose color is inside the region are allowed,
    and count equally. The red regions of `ite` and `un_r48` have no end toward the red: there `peak_nm` is the end.
    Photons are those of the study's lights, filters as designed.
    """

    norms: list[Norm] = Field(default=["en_12368"], min_length=1, max_length=3)
    """`en_12368` (European signal heads), `ite` (American ones), `un_r48` (vehicles; the same as SAE J578)."""
    wanted_dn: float = Field(gt=0, le=1e6)
    """CSD that a pair of lamps should have, DN."""
    peak_nm: Annotated[
        tuple[_Peak, _Peak],
        BeforeValidator(from_to, json_schema_input_type=Annotated[list[_Peak], Field(min_length=2, max_length=2)]),
    ] = (560.0, 660.0)
    """Peak wavelengths from and to, nm."""
    peak_step_nm: float = Field(default=1.0, ge=0.1, le=20)
    """Step of the peak wavelengths, nm."""
    fwhm_nm: Annotated[
        tuple[_Width, _Width],
        BeforeValidator(from_to, json_schema_input_type=Annotated[list[_Width], Field(min_length=2, max_length=2)]),
    ] = (10.0, 30.0)
    """Full widths at half maximum from and to, nm."""
    fwhm_step_nm: float = Field(default=2.0, ge=0.1, le=50)
    """Step of the widths, nm."""

    @model_validator(mode="after")
    def _ordered(self) -> RegionMap:
        for key, (low, high) in (("peak_nm", self.peak_nm), ("fwhm_nm", self.fwhm_nm)):
            if not low <= high:
                raise ValueError(f"{key}: {low:g} must not be above {high:g}")
        if len(set(self.norms)) < len(self.norms):
            raise ValueError("norms: one is named twice")
        count = self.peaks_nm.size * self.widths_nm.size
        if count > _MOST_LEDS:
            raise ValueError(f"{count:,} LEDs are too many: at most {_MOST_LEDS:,}, with larger steps")
        return self

    @property
    def peaks_nm(self) -> Float[Array, " peaks"]:
        """Peaks, nm."""
        return _steps(*self.peak_nm, self.peak_step_nm)

    @property
    def widths_nm(self) -> Float[Array, " widths"]:
        """Full widths at half maximum, nm."""
        return _steps(*self.fwhm_nm, self.fwhm_step_nm)


@dataclass(frozen=True)
class SingleLeds:
    """LEDs by peak and full width at half maximum, nm."""

    peak_nm: Float[Array, " leds"]
    fwhm_nm: Float[Array, " leds"]

    def photons(self, grid: WavelengthGrid) -> Float[Array, "leds wavelengths"]:
        """Return photon spectra that integrate to 1 on the grid."""
        return equal_photons(grid, self._shapes(grid))

    def allowed(self, norm: Norm, kind: str) -> SingleLeds:
        """Return the LEDs whose color is inside a norm's region."""
        inside = SIGNAL_REGIONS[norm][kind].violation(chromaticity(VISIBLE, self._shapes(VISIBLE))) <= 0
        return SingleLeds(self.peak_nm[inside], self.fwhm_nm[inside])

    def _shapes(self, grid: WavelengthGrid) -> Float[Array, "leds wavelengths"]:
        """Return photon spectra with a peak of 1."""
        decays = self.fwhm_nm / _FWHM
        nodes = grid.nodes_nm
        shapes = [led_photons(nodes, peak, a, a) for peak, a in zip(self.peak_nm, decays, strict=True)]
        return np.asarray(shapes, dtype=float).reshape(-1, grid.size)


def all_leds(requested: RegionMap) -> SingleLeds:
    """Return all peaks with all widths."""
    peaks, widths = np.meshgrid(requested.peaks_nm, requested.widths_nm, indexing="ij")
    return SingleLeds(peaks.ravel(), widths.ravel())


def _steps(low: float, high: float, step: float) -> Float[Array, " steps"]:
    return np.asarray(low + step * np.arange(math.floor((high - low) / step + 1e-9) + 1), dtype=float)


class Keys(Section):
    """Keys of a study."""

    regions: RegionMap | None = None
    """Map of the yellow and red lamps that a norm allows and each CFA separates."""


KEYS = {"StudySection": Keys}


def faults(checked: Checked) -> Iterator[Fault]:
    """Check that LEDs lie on the study's wavelengths and at a named phase, and that each norm allows some."""
    section, regions = checked.section, checked.section.key("regions")
    if regions is None:
        return
    misplaced = [*_misplaced_regions(section, regions)]
    yield from misplaced
    if misplaced:
        return
    leds = all_leds(regions)
    for norm in regions.norms:
        for kind in ("yellow", "red"):
            if not leds.allowed(norm, kind).peak_nm.size:
                problem = f"none of the {leds.peak_nm.size:,} LEDs is {kind} as {norm} allows it"
                yield Fault(("regions",), problem, None, "other ends or smaller steps of `peak_nm` and `fwhm_nm`")


def _misplaced_regions(section: StudySection, regions: RegionMap) -> Iterator[Fault]:
    grid, (low, high) = section.wavelengths, regions.peak_nm
    if not grid.start_nm <= low <= high <= grid.stop_nm:
        allowed = f"{grid.start_nm:g} to {grid.stop_nm:g} nm"
        yield Fault(("regions", "peak_nm"), "peaks outside the study's wavelengths", [low, high], allowed)
    if grid.step_nm > regions.fwhm_nm[0]:
        problem = "an LED is narrower than a step of the study's wavelengths"
        yield Fault(("regions", "fwhm_nm"), problem, list(regions.fwhm_nm), f"{grid.step_nm:g} nm or more")
    for name, scene in section.scenarios.items():
        if scene.target is not None and scene.target.phase_px == "any":
            problem = "`regions` needs a named sampling phase"
            yield Fault(("scenarios", name, "target", "phase_px"), problem, "any", "[column, row]")
