"""Make a family by its name from a study's words."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from pydantic import Field, model_validator

from ..errors import Fault, SweepError, nearest
from ..types import FloatArray, Positive, Section
from .dual import Dual
from .family import Family
from .free_form import FreeForm
from .stopband import Stopband

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


@dataclass(frozen=True)
class Maker:
    """How a family is made: the channels that it replaces, whether it takes `to`, its own option, and the maker.

    `make` takes the wavelengths, the base, the target (None without `to`) and the options.
    """

    n_modified: int
    needs_target: bool
    option: str | None
    make: Callable[[FloatArray, FloatArray, FloatArray | None, FamilyOptions], Family]


def _stopband(wavelength_nm: FloatArray, base: FloatArray, target: FloatArray | None, options: FamilyOptions) -> Family:
    assert target is not None
    return Stopband(wavelength_nm, base, target, options.bands or 1)


def _dual(wavelength_nm: FloatArray, base: FloatArray, target: FloatArray | None, _: FamilyOptions) -> Family:
    assert target is not None
    if not (target > base).any():
        raise SweepError(Fault("dual needs a ceiling `to` above its base: there is no room to swing"))
    return Dual(wavelength_nm, base, target)


def _free_form(wavelength_nm: FloatArray, base: FloatArray, _: FloatArray | None, options: FamilyOptions) -> Family:
    nodes = options.nodes
    assert nodes is not None
    if nodes.start_nm < wavelength_nm[0] or nodes.stop_nm > wavelength_nm[-1]:
        place = f"{nodes.start_nm:g} to {nodes.stop_nm:g} nm"
        allowed = f"{wavelength_nm[0]:g} to {wavelength_nm[-1]:g} nm"
        raise SweepError(Fault("nodes outside the wavelength grid", value=place, allowed=allowed))
    count = round((nodes.stop_nm - nodes.start_nm) / nodes.step_nm) + 1
    return FreeForm(wavelength_nm, base, nodes.start_nm + nodes.step_nm * np.arange(count, dtype=float))


MAKERS: Mapping[str, Maker] = {
    "stopband": Maker(1, needs_target=True, option=None, make=_stopband),
    "multi_stopband": Maker(1, needs_target=True, option="bands", make=_stopband),
    "dual": Maker(2, needs_target=True, option=None, make=_dual),
    "free_form": Maker(1, needs_target=False, option="nodes", make=_free_form),
}
"""Every family that a study can name."""


def build_family(
    name: str, wavelength_nm: FloatArray, base: FloatArray, target: FloatArray | None, options: FamilyOptions
) -> Family:
    """The family `name` over `base`.

    Raises SweepError when there is no such family, and when it lacks a target or an option, or has one too many.
    """
    maker = MAKERS.get(name)
    if maker is None:
        allowed = ", ".join(MAKERS)
        raise SweepError(Fault("unknown family", value=name, allowed=allowed, nearest=nearest(name, MAKERS)))
    if (target is not None) != maker.needs_target:
        raise SweepError(Fault(f"{name} {'needs' if maker.needs_target else 'has no'} `to`"))
    for option in FamilyOptions.model_fields:
        given = getattr(options, option)
        if (given is not None) != (option == maker.option):
            owners = " or ".join(owner for owner, made in MAKERS.items() if made.option == option)
            raise SweepError(Fault(f"`{option}` goes with {owners}, and {owners} with `{option}`", value=given))
    return maker.make(wavelength_nm, base, target, options)
