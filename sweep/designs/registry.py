"""Families that a study can name, collected from `families`."""

from __future__ import annotations

from typing import Any

from pydantic import Field, create_model

from ..base.errors import SweepError, ValidationIssue, nearest
from ..base.modules import files_in
from ..base.types import FloatArray, Section
from . import families
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
    return {
        name: (field.rebuild_annotation() | None, Field(default=None, description=field.description))
        for name, field in every.items()
    }


class FamilyOptions(create_model("_FamilyOptions", __base__=Section, **_optional(FAMILIES))):  # type: ignore[misc]
    """Options of the family; each family has options of its own."""


def described_families() -> str:
    """Return the families with their options, for messages.

    Returns
    -------
    str
        Text.
    """
    families = []
    for kind, family in FAMILIES.items():
        options = ", ".join(family.Options.model_fields)
        families.append(kind + (f" (options: {options})" if options else ""))
    return ", ".join(families)


def options_of(kind: str, options: FamilyOptions, *, has_target: bool) -> Section:
    """Return the options of a family, out of those of all.

    Parameters
    ----------
    kind : str
        Name of the family.
    options : FamilyOptions
        Options of the study.
    has_target : bool
        True if the study names a target curve.

    Returns
    -------
    Section
        Options of the family.

    Raises
    ------
    SweepError
        If there is no such family, or if a target or option is missing or superfluous.
    """
    family = FAMILIES.get(kind)
    if family is None:
        allowed = ", ".join(FAMILIES)
        raise SweepError(
            ValidationIssue("unknown family", value=kind, allowed=allowed, nearest=nearest(kind, FAMILIES))
        )
    if has_target != family.needs_target:
        raise SweepError(ValidationIssue(f"{kind} {'needs' if family.needs_target else 'has no'} `to`"))
    given = {name: value for name in FamilyOptions.model_fields if (value := getattr(options, name)) is not None}
    known_options = family.Options.model_fields
    needed = {name for name, field in known_options.items() if field.is_required()}
    for name in FamilyOptions.model_fields:
        if (name in given and name not in known_options) or (name in needed and name not in given):
            owners = " or ".join(owner for owner, made in FAMILIES.items() if name in made.Options.model_fields)
            problem = f"`{name}` goes with {owners}, and {owners} with `{name}`"
            raise SweepError(ValidationIssue(problem, value=given.get(name)))
    return family.Options(**given)


def build_family(
    kind: str, wavelength_nm: FloatArray, base: FloatArray, target: FloatArray | None, options: FamilyOptions
) -> Family:
    """Make a family.

    Parameters
    ----------
    kind : str
        Name of the family.
    wavelength_nm, base, target : ndarray of shape (n_wavelengths,)
        Wavelengths, nm, and curves; see `Family.of_study`.
    options : FamilyOptions
        Options of the study.

    Returns
    -------
    Family
        The family.

    Raises
    ------
    SweepError
        If there is no such family, or if a target or option is missing or superfluous.
    """
    own = options_of(kind, options, has_target=target is not None)
    return FAMILIES[kind].of_study(wavelength_nm, base, target, own)
