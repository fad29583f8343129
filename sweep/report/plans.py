"""How each scene is simulated, in words."""

from __future__ import annotations

from collections.abc import Iterator

from ..plan import EFFECTS, Plan
from ..study import Study


def plan_lines(study: Study, *, explain: bool) -> Iterator[str]:
    """Every scene's effects with method, promised error, reason and work; scenes of one plan are told at once."""
    groups: dict[tuple[object, ...], list[Plan]] = {}
    for plan in study.plans.values():
        groups.setdefault((plan.key, *(f"{c.promised_dn:.2g}{c.reason}" for c in plan.choices)), []).append(plan)
    for plans in groups.values():
        yield from _lines(plans, explain=explain)
    computed = sum(plan.work for plan in study.plans.values())
    whole = sum(plan.reference_work for plan in study.plans.values())
    yield (
        f"{len(study.plans)} scenes, {len(groups)} different plans; about {computed:.2g} operations, "
        f"{whole / max(computed, 1.0):.1f} times fewer than with everything on."
    )


def _lines(plans: list[Plan], *, explain: bool) -> Iterator[str]:
    plan = plans[0]
    names = (
        plans[0].scenario if len(plans) == 1 else f"{plans[0].scenario} ... {plans[-1].scenario} ({len(plans)} scenes)"
    )
    yield (
        f"{names}: promised {plan.promised_dn:.2g} of {plan.tolerance_dn:g} DN, about {plan.work:.2g} operations "
        f"(everything on: {plan.reference_work:.2g})"
    )
    width = max(map(len, EFFECTS))
    for choice in plan.choices:
        yield f"  {choice.effect:<{width}}  {choice.method:<16}  {choice.promised_dn:>8.2g} DN  {choice.reason}"
    if explain:
        for effect, method, promised in plan.rejected:
            yield f"  rejected: {effect} = {method}, which changes a CSD by up to {promised:.3g} DN"
    yield ""
