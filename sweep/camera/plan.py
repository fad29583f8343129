"""Choice of the effects of a scene that are computed, with reasons."""

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
    """One effect of a plan.

    `computed`: False if it is left out; `bound_dn`: upper bound on the change of any CSD without it, DN; 0 if it is
    inactive, None if no closed form is known.
    """

    effect: str
    computed: bool
    bound_dn: float | None
    reason: str


@dataclass(frozen=True)
class Plan:
    """Plan of one scene: accuracy settings, and a choice for each effect.

    The bounds of all that is left out sum to at most half the tolerance. The other half is for the settings, whose
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
        """Upper bound on the change of any CSD by all effects that are left out, at the same settings, DN."""
        return sum(choice.bound_dn or 0.0 for choice in self.choices if not choice.computed)

    @cached_property
    def key(self) -> str:
        """Hash of effects and settings, part of every cache key and of every row."""
        computed = {"computed": self.computed, "accuracy": self.accuracy.model_dump()}
        return hashlib.sha256(json.dumps(computed, sort_keys=True).encode()).hexdigest()[:12]


def plan_scene(
    scenario: str, boxes: Sequence[Box], tolerance_dn: float, accuracy: Accuracy, *, for_noise: bool = False
) -> Plan:
    """Choose the effects that a scene must compute to stay within a tolerance, DN.

    Active effects with the smallest bounds are left out first. Effects of the readout come before the optics, whose
    bounds depend on them.

    `boxes`: designs of the scene, one box per design space; `for_noise`: errors under noise are requested, which need
    every pixel and its readout.
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
    chosen = [choice for choice in choices.values() if choice is not None]
    chosen += [Choice(effect.name, True, None, _OWN) for effect in boxes[0].setup.user_effects]
    return Plan(scenario, tolerance_dn, accuracy, tuple(chosen))


def _inactive(effect: Effect, boxes: Sequence[Box]) -> Choice | None:
    """Return the choice for an effect that is inactive in every box, else None."""
    reasons = [effect.inactive(box) for box in boxes]
    return None if None in reasons else Choice(effect.name, False, 0.0, str(reasons[0]))


def _bound_dn(effect: Effect, boxes: Sequence[Box], readout: frozenset[str]) -> float | None:
    if effect.bound_dn is None or any(box.setup.camera.pixel.captures for box in boxes):
        return None
    bounds = [effect.bound_dn(box, readout) for box in boxes]
    return max(bounds) if all(bound < float("inf") for bound in bounds) else None


def _order(item: tuple[str, float | None]) -> tuple[bool, float]:
    """Sort by bound, with saturation last, since noise and rounding need it."""
    name, bound_dn = item
    return name == "saturation", float("inf") if bound_dn is None else bound_dn


def _reason(bound_dn: float | None, leave_out: bool, needed: bool) -> str:
    if leave_out:
        return "bound below the remaining tolerance"
    if needed:
        return "errors under noise need it"
    return "no closed bound: computed wherever it is active" if bound_dn is None else "may change more than is allowed"
