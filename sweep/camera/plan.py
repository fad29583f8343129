"""Which effects of a scene are computed, which are left out, and why."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from .accuracy import Accuracy
from .effects import EFFECTS, Box, Effect
from .setup import READOUT

_OWN = "an effect of the study's own: always computed"


@dataclass(frozen=True)
class Choice:
    """One effect of a plan: whether it is computed, a bound on what it changes in any CSD (DN), and why.

    `bound_dn`: 0 of an effect that is inactive, None where no closed form is known.
    """

    effect: str
    computed: bool
    bound_dn: float | None
    reason: str


@dataclass(frozen=True)
class Plan:
    """Plan of one scene's simulation: accuracy settings, and a choice for each effect.

    The bounds of what is left out sum to at most half the tolerance; the other half is that of the settings, whose
    error is measured (`sweep audit`).
    """

    scenario: str
    tolerance_dn: float
    accuracy: Accuracy
    choices: tuple[Choice, ...]

    @property
    def left_out(self) -> frozenset[str]:
        """Effects that are not computed."""
        return frozenset(choice.effect for choice in self.choices if not choice.computed)

    @property
    def computed(self) -> tuple[str, ...]:
        """Effects that are computed."""
        return tuple(choice.effect for choice in self.choices if choice.computed)

    @property
    def error_bound_dn(self) -> float:
        """No CSD differs by more from one with every effect, by the same settings."""
        return sum(choice.bound_dn or 0.0 for choice in self.choices if not choice.computed)

    @cached_property
    def key(self) -> str:
        """Hash of what is computed and how: part of every cache key, and in every row."""
        computed = {"computed": self.computed, "accuracy": self.accuracy.model_dump()}
        return hashlib.sha256(json.dumps(computed, sort_keys=True).encode()).hexdigest()[:12]


def plan_scene(
    scenario: str, boxes: Sequence[Box], tolerance_dn: float, accuracy: Accuracy, *, for_noise: bool = False
) -> Plan:
    """The plan of a scene that holds for all its boxes of designs.

    Of the effects that are active the smallest bounds are left out first. What the readout does comes before the
    optics, whose bounds depend on it.

    Parameters
    ----------
    scenario : str
        Name of the scene.
    boxes : sequence of Box
        Designs of the scene, those of each space.
    tolerance_dn : float
        Tolerance of any CSD, DN.
    accuracy : Accuracy
        Settings of the study.
    for_noise : bool
        Errors under noise are asked for, which need every pixel and what the readout does to it.
    """
    choices = {name: _inactive(effect, boxes) for name, effect in EFFECTS.items()}
    active = [name for name, choice in choices.items() if choice is None]
    budget_dn, computed = tolerance_dn / 2, frozenset(READOUT & set(active))
    for stage in (READOUT, set(active) - READOUT):
        bounds = {name: _bound_dn(EFFECTS[name], boxes, computed) for name in active if name in stage}
        for name, bound_dn in sorted(bounds.items(), key=_order):
            needed = for_noise and name in READOUT
            clips = name == "saturation" and computed & {"noise", "quantization"}
            leave_out = bound_dn is not None and bound_dn <= budget_dn and not needed and not clips
            if leave_out:
                budget_dn -= bound_dn or 0.0
                computed -= {name}
            choices[name] = Choice(name, not leave_out, bound_dn, _reason(bound_dn, leave_out, needed))
    made = [choice for choice in choices.values() if choice is not None]
    made += [Choice(effect.name, True, None, _OWN) for effect in boxes[0].setup.own_effects]
    return Plan(scenario, tolerance_dn, accuracy, tuple(made))


def _inactive(effect: Effect, boxes: Sequence[Box]) -> Choice | None:
    """The choice for an effect that changes nothing in any box; None where it may."""
    reasons = [effect.inactive(box) for box in boxes]
    return None if None in reasons else Choice(effect.name, False, 0.0, str(reasons[0]))


def _bound_dn(effect: Effect, boxes: Sequence[Box], readout: frozenset[str]) -> float | None:
    if effect.bound_dn is None:
        return None
    bounds = [effect.bound_dn(box, readout) for box in boxes]
    return max(bounds) if all(bound < float("inf") for bound in bounds) else None


def _order(item: tuple[str, float | None]) -> tuple[bool, float]:
    """Smallest bounds first; saturation last, since noise and rounding need it."""
    name, bound_dn = item
    return name == "saturation", float("inf") if bound_dn is None else bound_dn


def _reason(bound_dn: float | None, leave_out: bool, needed: bool) -> str:
    if leave_out:
        return "less than the tolerance leaves room for"
    if needed:
        return "errors under noise need it"
    return "no closed bound: computed wherever it is active" if bound_dn is None else "may change more than is allowed"
