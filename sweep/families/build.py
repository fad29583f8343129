"""Make a family by its name from a study's words."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from pydantic import Field, model_validator

from ..arrays import FloatArray
from ..errors import Fault, SweepError
from ..schema import Positive, Section
from .base import Family
from .dual import Dual
from .free_form import FreeForm
from .stopband import Stopband

CHANNELS: Mapping[str, int] = {"stopband": 1, "multi_stopband": 1, "dual": 2, "free_form": 1}
"""Every family that a study can name, with the number of channels that it replaces."""


_MOST_NODES = 500


class Nodes(Section):
    """Equidistant nodes of a free-form filter."""

    start_nm: Positive
    stop_nm: Positive
    step_nm: Positive

    @model_validator(mode="after")
    def _whole_steps(self) -> Nodes:
        steps = (self.stop_nm - self.start_nm) / self.step_nm
        if not 1 <= steps < _MOST_NODES:
            raise ValueError(f"nodes: {steps + 1:g} of them; allowed: 2 to {_MOST_NODES}")
        if not abs(steps - round(steps)) < 1e-6:
            raise ValueError(f"step_nm {self.step_nm:g} must divide {self.stop_nm - self.start_nm:g}")
        return self


class FamilyOptions(Section):
    """What a family needs beside its parameters: `bands` of multi_stopband, `nodes` of free_form."""

    bands: int | None = Field(default=None, ge=1, le=8)
    nodes: Nodes | None = None


def build_family(
    name: str, wavelength_nm: FloatArray, base: FloatArray, target: FloatArray | None, options: FamilyOptions
) -> Family:
    """The family `name` over `base`; raises SweepError when it lacks a target or an option, or has one too many."""
    needs_target = name != "free_form"
    if (target is None) == needs_target:
        raise SweepError(Fault(f"{name} {'needs' if needs_target else 'has no'} `to`"))
    if (options.bands is None) == (name == "multi_stopband"):
        raise SweepError(
            Fault("`bands` goes with multi_stopband, and multi_stopband with `bands`", value=options.bands)
        )
    if (options.nodes is None) == (name == "free_form"):
        raise SweepError(Fault("`nodes` goes with free_form, and free_form with `nodes`"))
    if name == "dual" and target is not None:
        if not (target > base).any():
            raise SweepError(Fault("dual needs a ceiling `to` above its base: there is no room to swing"))
        return Dual(wavelength_nm, base, target)
    if options.nodes is not None:
        nodes = options.nodes
        if nodes.start_nm < wavelength_nm[0] or nodes.stop_nm > wavelength_nm[-1]:
            place = f"{nodes.start_nm:g} to {nodes.stop_nm:g} nm"
            allowed = f"{wavelength_nm[0]:g} to {wavelength_nm[-1]:g} nm"
            raise SweepError(Fault("nodes outside the wavelength grid", value=place, allowed=allowed))
        count = round((nodes.stop_nm - nodes.start_nm) / nodes.step_nm) + 1
        return FreeForm(wavelength_nm, base, nodes.start_nm + nodes.step_nm * np.arange(count, dtype=float))
    assert target is not None
    return Stopband(wavelength_nm, base, target, options.bands or 1)
