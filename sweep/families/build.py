"""Make a family by its name from a study's words."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from pydantic import Field

from ..arrays import FloatArray
from ..errors import Fault, SweepError
from ..schema import Positive, Section
from .base import Family
from .dual import Dual
from .free_form import FreeForm
from .stopband import Stopband

CHANNELS: Mapping[str, int] = {"stopband": 1, "multi_stopband": 1, "dual": 2, "free_form": 1}
"""Every family that a study can name, with the number of channels that it replaces."""


class Nodes(Section):
    """Equidistant nodes of a free-form filter."""

    start_nm: Positive
    stop_nm: Positive
    step_nm: Positive


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
        return Dual(wavelength_nm, base, target)
    if options.nodes is not None:
        nodes = options.nodes
        count = round((nodes.stop_nm - nodes.start_nm) / nodes.step_nm) + 1
        return FreeForm(wavelength_nm, base, nodes.start_nm + nodes.step_nm * np.arange(max(count, 0), dtype=float))
    assert target is not None
    return Stopband(wavelength_nm, base, target, options.bands or 1)
