"""Physical principle of a filter: a pigment is fixed, an interference filter moves with the angle of the light."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_serializer

from ..base.types import Section

PIGMENT = "pigment"


class Interference(Section):
    """Thin layers: at an angle t a band stands at l sqrt(1 - (sin t / n)^2) (Smith, Modern Optical Engineering)."""

    effective_index: float = Field(ge=1.05, le=10)
    """Effective index n of the whole stack; about 1.5 to 2.2 for evaporated layers."""


class Technology(Section):
    """A pigment, or `interference`."""

    interference: Interference | None = None
    """Thin-film coating, which moves with the angle of the light."""

    @property
    def index(self) -> float:
        """Effective index; infinite for a pigment, which does not move."""
        return math.inf if self.interference is None else self.interference.effective_index

    @property
    def description(self) -> str:
        """Text for messages."""
        return PIGMENT if self.interference is None else f"interference with effective index {self.index:g}"

    @model_serializer
    def _as_written(self) -> str | dict[str, dict[str, float]]:
        """Return the value of a study file."""
        return PIGMENT if self.interference is None else {"interference": {"effective_index": self.index}}


def _technology(value: Any) -> Any:
    """Convert `pigment`, or a mapping with `interference`."""
    if value == PIGMENT:
        return Technology()
    if value is None or isinstance(value, Technology) or (isinstance(value, dict) and value.get("interference")):
        return value
    raise ValueError(f"a technology is `{PIGMENT}`, or `interference: {{effective_index: 1.8}}`")


Stated = Annotated[
    Technology | None,
    BeforeValidator(_technology, json_schema_input_type=Literal["pigment"] | Technology | None),
]
"""A technology as a study states it, or not."""


def index_of(technology: Technology | None) -> float:
    """Return the effective index of a technology.

    Infinite for a filter that does not move, or if nothing is stated.
    """
    return math.inf if technology is None else technology.index
