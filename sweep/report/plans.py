"""The plan of each scene, in words."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

from ..camera.plan import Plan
from ..study import Study


def plan_lines(study: Study) -> Iterator[str]:
    """Effects of every scene: computed or left out, bound and reason; scenes of one plan together."""
    groups: dict[str, list[Plan]] = {}
    for plan in study.plans.values():
        groups.setdefault(plan.key, []).append(plan)
    for plans in groups.values():
        yield from _lines(plans)
    settings = ", ".join(f"{name} {value}" for name, value in study.section.accuracy.model_dump().items())
    yield f"{len(study.plans)} scenes, {len(groups)} different plans. Accuracy: {settings}."


def plan_facts(study: Study) -> dict[str, Any]:
    """The same as plain values: accuracy, and for each scene tolerance, error bound (DN) and effects."""
    scenes = {
        name: {
            "tolerance_dn": plan.tolerance_dn,
            "error_bound_dn": plan.error_bound_dn,
            "effects": [asdict(choice) for choice in plan.choices],
        }
        for name, plan in study.plans.items()
    }
    return {"study": study.name, "accuracy": study.section.accuracy.model_dump(), "scenarios": scenes}


def _lines(plans: list[Plan]) -> Iterator[str]:
    """Scenes that are computed alike, with the largest bound of each effect among them."""
    first, last = plans[0].scenario, plans[-1].scenario
    names = first if len(plans) == 1 else f"{first} ... {last} ({len(plans)} scenes)"
    left_out_dn = max(plan.error_bound_dn for plan in plans)
    tolerance_dn = plans[0].tolerance_dn
    yield f"{names}: what is left out changes a CSD by at most {left_out_dn:.2g} DN (tolerance {tolerance_dn:g} DN)"
    width = max(len(choice.effect) for choice in plans[0].choices)
    for choices in zip(*(plan.choices for plan in plans), strict=True):
        choice = max(choices, key=lambda c: c.bound_dn or 0.0)
        bound = "no bound" if choice.bound_dn is None else f"{choice.bound_dn:.2g} DN"
        done = "computed" if choice.computed else "left out"
        yield f"  {choice.effect:<{width}}  {done}  {bound:>11}  {choice.reason}"
    yield ""
