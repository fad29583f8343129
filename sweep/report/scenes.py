"""Effects of each scene that are computed and left out, with bounds and reasons."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any

import pandas as pd

from ..camera.plan import Choice, Plan
from ..study import Study
from .numbers import inward
from .sections import left_out_words
from .tables import aligned


def effect_table(effects: Sequence[Choice]) -> pd.DataFrame:
    """Return every effect with its bound and reason."""
    rows = [
        {
            "effect": effect.effect,
            "computed": "computed" if effect.computed else "left out",
            "bound / DN": "none" if effect.bound_dn is None else f"{effect.bound_dn:.2g}",
            "reason": effect.reason,
        }
        for effect in effects
    ]
    return pd.DataFrame(rows)


def plan_lines(study: Study, seconds: tuple[float, float] | None) -> Iterator[str]:
    """Yield the effects of every scene with bound and reason; scenes of one plan together.

    `seconds`: see `seconds_of_effects`.
    """
    groups: dict[str, list[Plan]] = {}
    for plan in study.plans.values():
        groups.setdefault(plan.key, []).append(plan)
    for plans in groups.values():
        left_out_dn = max(plan.error_bound_dn for plan in plans)
        several = f" ... {plans[-1].scenario} ({len(plans)} scenes)" if len(plans) > 1 else ""
        yield (
            f"{plans[0].scenario}{several}: what is left out changes a CSD by at most "
            f"{inward(left_out_dn, 2, up=True):.2g} DN (tolerance {plans[0].tolerance_dn:g} DN)"
        )
        effects = zip(*(plan.choices for plan in plans), strict=True)
        largest = [max(choices, key=lambda choice: choice.bound_dn or 0.0) for choices in effects]
        yield from (f"  {line}" for line in aligned(effect_table(largest)))
        yield ""
    every = study.plans.values()
    risk_dn, tolerance_dn = max(plan.error_bound_dn for plan in every), max(plan.tolerance_dn for plan in every)
    choices = [choice for plan in every for choice in plan.choices]
    left_out = {one.effect for one in choices} - {one.effect for one in choices if one.computed}
    yield f"Left out: {left_out_words(len(left_out), risk_dn, tolerance_dn, seconds)}."
    settings = ", ".join(f"{name} {value}" for name, value in study.section.accuracy.model_dump().items())
    yield f"{len(study.plans)} scenes, {len(groups)} different plans. Accuracy: {settings}."


def plan_facts(study: Study, seconds: tuple[float, float] | None) -> dict[str, Any]:
    """Return accuracy, time with and without effects, and tolerance, error bound (DN) and effects of each scene."""
    scenes = {
        name: {
            "tolerance_dn": plan.tolerance_dn,
            "error_bound_dn": plan.error_bound_dn,
            "effects": [asdict(choice) for choice in plan.choices],
        }
        for name, plan in study.plans.items()
    }
    accuracy = study.section.accuracy.model_dump()
    return {"study": study.name, "accuracy": accuracy, "seconds_of_effects": seconds, "scenarios": scenes}
