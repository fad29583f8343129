"""Accuracy settings: sampling of the camera, and its cost in time."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, ValidatorFunctionWrapHandler, WrapValidator

from ..base.types import Section

Preset = Literal["standard", "reference"]


class Accuracy(Section):
    """Numerical settings of the simulation; `make accuracy` measures the time and error of each."""

    phases_per_px: Literal[1, 4, 16, 64] = 16
    """Sampling phases of a light that may fall anywhere, on a square lattice in each pixel of the tile; phases that are
    equal by symmetry are computed once."""
    finest_phase_px: float = Field(default=1 / 8192, ge=0, le=0.25)
    """Finest step to which the worst phases of a lattice four times as fine are refined, pixels, unless CSDs hardly
    differ before; 0: no refinement."""
    field_positions: int = Field(default=33, ge=2, le=257)
    """Image heights where all field positions count; the worst are refined, unless `finest_phase_px` is 0."""
    rays: Annotated[int, Field(ge=1, le=64)] | None = None
    """Rays of the lens's cone that an interference filter sees; left out, the integral over all of them."""
    psf_step_nm: float = Field(default=10.0, gt=0, le=100)
    """Wavelength step of the point spread function, linear in between; a coarser grid is not refined."""
    pwm_moments: int = Field(default=9, ge=2, le=1000)
    """Moments of a pulse behind a nonlinear readout, eight times as many at the worst phase."""

    @property
    def phase_steps_per_px(self) -> int:
        """Phases of the lattice along a row or column of one pixel."""
        return {1: 1, 4: 2, 16: 4, 64: 8}[self.phases_per_px]


STANDARD = Accuracy()
PRESETS: dict[str, Accuracy] = {
    "standard": STANDARD,
    "reference": Accuracy(
        phases_per_px=64,
        finest_phase_px=1 / 32768,
        field_positions=129,
        psf_step_nm=1e-3,
        pwm_moments=17,
    ),
}
REFERENCE = PRESETS["reference"]


def _from_preset(value: Any, check: ValidatorFunctionWrapHandler) -> Accuracy:
    """Return settings from the name of a preset, or from a mapping of changes to its `preset`."""
    settings = {"preset": value} if isinstance(value, str) else value
    if not isinstance(settings, dict):
        return check(settings)  # type: ignore[no-any-return]
    preset = settings.get("preset", "standard")
    if preset not in PRESETS:
        raise ValueError(f"the presets are {', '.join(PRESETS)}")
    return check(PRESETS[preset].model_dump() | {k: v for k, v in settings.items() if k != "preset"})  # type: ignore[no-any-return]


AccuracySection = Annotated[
    Accuracy,
    WrapValidator(_from_preset, json_schema_input_type=Preset | Accuracy),
]
"""The `accuracy` key of a study: `standard`, `reference`, or settings with an optional `preset`."""
