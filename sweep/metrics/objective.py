"""What a study maximizes: one quantity, or the smallest or the sum of several weighted ones."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from ..types import FloatArray, Section

Weight = Annotated[float, Field(ge=1e-6, le=1e6)]

COMBINED = "objective"
"""Column of an objective that is not simply one of the quantities."""


class Objective(Section):
    """Maximize the smallest (`minimum`) or the sum (`sum`) of weight x quantity.

    A name alone is that quantity; a list is the smallest of its members.
    """

    minimum: dict[str, Weight] = {}
    sum: dict[str, Weight] = {}

    @model_validator(mode="before")
    @classmethod
    def _from_names(cls, value: Any) -> Any:
        names = [value] if isinstance(value, str) else value
        if isinstance(names, list) and all(isinstance(name, str) for name in names):
            return {"minimum": dict.fromkeys(names, 1.0)}
        return value

    @classmethod
    def __get_pydantic_json_schema__(cls, core_schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """What a file may say: a name, a list of names, or the mapping."""
        name = {"type": "string"}
        return {"anyOf": [name, {"type": "array", "items": name, "minItems": 1}, handler(core_schema)]}

    @model_validator(mode="after")
    def _one_rule(self) -> Objective:
        if bool(self.minimum) == bool(self.sum):
            raise ValueError("an objective is a quantity, a list, `minimum: {quantity: weight}` or `sum: {...}`")
        return self

    @property
    def weights(self) -> Mapping[str, float]:
        """Quantity -> weight."""
        return self.minimum or self.sum

    @property
    def rule(self) -> Literal["minimum", "sum"]:
        """How the weighted quantities become one number."""
        return "minimum" if self.minimum else "sum"

    @property
    def column(self) -> str:
        """Column of the result table that holds it."""
        return next(iter(self.weights)) if list(self.weights.values()) == [1.0] else COMBINED

    def of(self, columns: Mapping[str, FloatArray]) -> FloatArray:
        """Its value from the quantities, ndarray[n_designs] each."""
        terms = np.stack([weight * columns[name] for name, weight in self.weights.items()])
        return np.asarray(terms.min(axis=0) if self.minimum else terms.sum(axis=0), dtype=float)

    def __str__(self) -> str:
        terms = [name if weight == 1 else f"{weight:g} {name}" for name, weight in self.weights.items()]
        if len(terms) == 1:
            return terms[0]
        return f"smallest of {', '.join(terms)}" if self.minimum else " + ".join(terms)
