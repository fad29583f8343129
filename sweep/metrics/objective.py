"""Objective of a study: one quantity, or several weighted ones under a rule."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any

import numpy as np
from pydantic import Field, GetJsonSchemaHandler, create_model, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from ..base.modules import files_in, instances_of
from ..base.types import PerDesign, Section
from . import rules
from .quantity import LOG10, Quantity, RequestedQuantities
from .registry import quantities_of
from .rule import Rule
from .rules.standard import Minimum

Weight = Annotated[float, Field(ge=1e-6, le=1e6)]

COMBINED = "objective"
"""Column of an objective that is not simply one of the quantities."""


RULES: Mapping[str, Rule] = {rule.name: rule for rule in instances_of(Rule, files_in(rules))}
"""Every rule by its key in a study."""
_FIELDS: dict[str, Any] = {name: (dict[str, Weight], {}) for name in RULES}


class Objective(create_model("_Rules", __base__=Section, **_FIELDS)):  # type: ignore[misc]
    """Maximize weight times quantity under one rule.

    The smallest of several (`minimum`), their `sum`, or for errors the `least`, which is -log10 of the largest weight
    times error. A name alone is that quantity; a list is the smallest of its members.
    """

    @model_validator(mode="before")
    @classmethod
    def _from_names(cls, value: Any) -> Any:
        names = [value] if isinstance(value, str) else value
        if isinstance(names, list) and all(isinstance(name, str) for name in names):
            return {Minimum.name: dict.fromkeys(names, 1.0)}
        return value

    @classmethod
    def __get_pydantic_json_schema__(cls, core_schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Return the schema of a name, a list of names, or the mapping."""
        name = {"type": "string"}
        return {"anyOf": [name, {"type": "array", "items": name, "minItems": 1}, handler(core_schema)]}

    @model_validator(mode="after")
    def _one_rule(self) -> Objective:
        if sum(bool(getattr(self, name)) for name in RULES) != 1:
            known = " or ".join(f"`{name}: {{quantity: weight}}`" for name in RULES)
            raise ValueError(f"an objective is a quantity, a list, {known}")
        return self

    @property
    def rule(self) -> Rule:
        """Rule that combines the weighted quantities."""
        return next(rule for name, rule in RULES.items() if getattr(self, name))

    @property
    def weights(self) -> Mapping[str, float]:
        """Weight of each quantity."""
        weights: Mapping[str, float] = getattr(self, self.rule.name)
        return weights

    @property
    def column(self) -> str:
        """Name of its column in the result table."""
        alone = list(self.weights.values()) == [1.0] and self.rule.direction == "more"
        return next(iter(self.weights)) if alone else COMBINED

    def of(self, columns: Mapping[str, PerDesign]) -> PerDesign:
        """Return the value of the objective."""
        return self.rule.of(np.stack([weight * columns[name] for name, weight in self.weights.items()]))

    def __str__(self) -> str:
        terms = [name if weight == 1 else f"{weight:g} {name}" for name, weight in self.weights.items()]
        return terms[0] if len(terms) == 1 and self.rule.direction == "more" else self.rule.words(terms)


def columns_of(requested: RequestedQuantities, objective: Objective) -> Mapping[str, Quantity]:
    """Return the quantities of a study's result table."""
    if objective.column != COMBINED:
        return quantities_of(requested)
    combined = Quantity(COMBINED, COMBINED, f"the study's objective: {objective}", direction="more", constrained=False)
    if objective.rule.direction == "less":
        combined = replace(combined, unit=LOG10, label=str(objective), digits=3, infinite=True)
    return {**quantities_of(requested), COMBINED: combined}
