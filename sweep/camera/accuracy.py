"""Accuracy as settings: how finely the camera is sampled, and what that costs."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, ValidatorFunctionWrapHandler, WrapValidator

from ..base.types import Section

Preset = Literal["fast", "standard", "reference"]


class Accuracy(Section):
    """Numerical settings of the simulation; `make accuracy` measures what each costs and which error it leaves.

    `phases_per_px`: sampling phases of a light that may fall anywhere, on a square lattice in each pixel of the tile;
    phases that see the same by symmetry are computed once. `finest_phase_px`: CSDs are computed on a lattice four times
    as fine, whose worst phases are refined down to this step; 0: on the lattice alone. `field_positions`: image heights
    from the middle of the sensor to its corner, where all of them count; the worst are refined, too, unless
    `finest_phase_px` is 0. `rays`: of the lens's cone that an interference filter sees, null: the integral over all of
    them. `psf_step_nm`: wavelengths at which the point spread function is computed, linear in between; a grid that is
    coarser is not refined. `pwm_moments`: moments of a pulse behind a nonlinear readout, eight times as fine at the
    worst phase, where the worst is refined (behind a linear readout its two ends are the extremes).
    `single_precision`: of the product of filters and light.
    """

    phases_per_px: Literal[1, 4, 16, 64] = 16
    finest_phase_px: float = Field(default=1 / 128, ge=0, le=0.25)
    field_positions: int = Field(default=33, ge=2, le=257)
    rays: Annotated[int, Field(ge=1, le=64)] | None = None
    psf_step_nm: float = Field(default=10.0, gt=0, le=100)
    pwm_moments: int = Field(default=9, ge=2, le=1000)
    single_precision: bool = False

    @property
    def phase_steps_per_px(self) -> int:
        """Phases of the lattice along a row or a column of one pixel."""
        return {1: 1, 4: 2, 16: 4, 64: 8}[self.phases_per_px]


STANDARD = Accuracy()
PRESETS: dict[str, Accuracy] = {
    "fast": Accuracy(finest_phase_px=0.0, field_positions=9, rays=16, psf_step_nm=10.0, pwm_moments=5),
    "standard": STANDARD,
    "reference": Accuracy(
        phases_per_px=64, finest_phase_px=1 / 512, field_positions=129, psf_step_nm=1e-3, pwm_moments=17
    ),
}
REFERENCE = PRESETS["reference"]


def _from_preset(value: Any, check: ValidatorFunctionWrapHandler) -> Accuracy:
    """Settings from a preset's name, or a mapping of settings that differ from those of its `preset`."""
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
"""The `accuracy` key of a study: `fast`, `standard`, `reference`, or settings with an optional `preset`."""
