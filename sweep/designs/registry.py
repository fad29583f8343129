"""Families that a study can name, collected from `families`."""

from __future__ import annotations

from typing import Any

from pydantic import create_model

from ..base.errors import SweepError, ValidationIssue, nearest
from ..base.modules import files_in
from ..base.types import Array, Float, PerWavelength, Section
from . import families
from .families.mixture import Absorbing, Mixture
from .family import Family


def _found() -> dict[str, type[Family]]:
    every = [value for file in files_in(families) for value in vars(file).values()]
    with_kind = [value for value in every if "kind" in getattr(value, "__dict__", {})]
    return {family.kind: family for family in with_kind}


FAMILIES = _found()
"""The class of each family, by its kind."""


def _optional(kinds: dict[str, type[Family]]) -> dict[str, Any]:
    """Return the options of all families as optional fields."""
    every = {name: field for family in kinds.values() for name, field in family.Options.model_fields.items()}
    return {name: (field.rebuild_annotation() | None, None) for name, field in every.items()}


class FamilyOptions(create_model("_FamilyOptions", __base__=Section, **_optional(FAMILIES))):  # type: ignore[misc]
    """Options of the family; each family has options of its own."""


def described_families() -> str:
    """Return the families with their options, for messages."""
    families = []
    for kind, family in FAMILIES.items():
        options = ", ".join(family.Options.model_fields)
        families.append(kind + (f" (options: {options})" if options else ""))
    return ", ".join(families)


PIGMENTS = tuple(kind for kind, family in FAMILIES.items() if issubclass(family, Absorbing))
"""Families of colorants, which do not move with the angle of the light."""


def build_family(
    kind: str,
    wavelength_nm: PerWavelength,
    base: PerWavelength,
    target: PerWavelength | None,
    options: FamilyOptions,
    colorants: Float[Array, "colorants wavelengths"] | None = None,
) -> Family:
    """Make a family.

    `wavelength_nm`, `base`, `target`: wavelengths, nm, and curves; see `Family.of_study`; `colorants`: absorbances of
    the study's catalog, each with a peak of 1. Raises SweepError if there is no such family, or if a target, option or
    catalog is missing or superfluous.
    """
    family = FAMILIES.get(kind)
    if family is None:
        allowed = ", ".join(FAMILIES)
        raise SweepError(
            ValidationIssue("unknown family", value=kind, allowed=allowed, nearest=nearest(kind, FAMILIES))
        )
    if (target is not None) != family.needs_target:
        allowed = "to: a curve, or a share of the base from 0 to 1" if family.needs_target else "no `to`"
        problem = f"{kind} {'needs' if family.needs_target else 'has no'} `to`"
        raise SweepError(ValidationIssue(problem, allowed=allowed))
    given = {name: value for name in FamilyOptions.model_fields if (value := getattr(options, name)) is not None}
    known_options = family.Options.model_fields
    needed = {name for name, field in known_options.items() if field.is_required()}
    for name in FamilyOptions.model_fields:
        if (name in given and name not in known_options) or (name in needed and name not in given):
            owners = " or ".join(
                owner for owner, family_class in FAMILIES.items() if name in family_class.Options.model_fields
            )
            problem = f"`{name}` goes with {owners}, and {owners} with `{name}`"
            raise SweepError(ValidationIssue(problem, value=given.get(name)))
    if kind == Mixture.kind and colorants is None:
        raise SweepError(ValidationIssue("mixture needs `colorants`, the catalog that it chooses from"))
    if kind == Mixture.kind:
        assert colorants is not None
        return Mixture(wavelength_nm, base, colorants, Mixture.Options(**given).at_most)
    return family.of_study(wavelength_nm, base, target, family.Options(**given))
