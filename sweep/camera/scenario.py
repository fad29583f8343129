"""A scene with all that effects ask of it."""

from __future__ import annotations

from typing import Any

from pydantic import create_model, model_validator

from ..base.types import Section
from .registry import EFFECTS
from .scene import Scene


def _options() -> dict[str, Any]:
    """The options of all effects with their defaults."""
    every = {name: field for e in EFFECTS.values() for name, field in e.Options.model_fields.items()}
    return {name: (field.rebuild_annotation(), field) for name, field in every.items()}


class Scenario(create_model("_EffectOptions", __base__=Section, **_options()), Scene):  # type: ignore[misc]
    """A scene of a study: `Scene` with the options of every effect, each of which is off where it is left out."""

    @model_validator(mode="after")
    def _effects_fit(self) -> Scenario:
        for effect in EFFECTS.values():
            if problem := effect.refused(self):
                raise ValueError(problem)
        return self
