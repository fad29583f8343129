"""How each scene is simulated, in words."""

from __future__ import annotations

from collections.abc import Iterator

from ..camera.plan.plan import Plan
from ..camera.registry import EFFECTS
from ..study import Study

_LEAST_S = 1e-6


def plan_lines(study: Study, *, explain: bool) -> Iterator[str]:
    """Every scene's effects with method, promised error, reason and work; scenes of one plan are told at once."""
    groups: dict[str, list[Plan]] = {}
    for plan in study.plans.values():
        groups.setdefault(plan.key, []).append(plan)
    for plans in groups.values():
        yield from _lines(plans, explain=explain)
    computed = sum(plan.work for plan in study.plans.values())
    whole = sum(plan.reference_work for plan in study.plans.values())
    yield (
        f"{len(study.plans)} scenes, {len(groups)} different plans; about {computed:.2g} s on one core, "
        f"{whole / max(computed, _LEAST_S):.1f} times less than with everything on (estimated)."
    )


def _lines(plans: list[Plan], *, explain: bool) -> Iterator[str]:
    """Scenes that are computed alike, with the largest promise of each effect among them."""
    first, last = plans[0].scenario, plans[-1].scenario
    names = first if len(plans) == 1 else f"{first} ... {last} ({len(plans)} scenes)"
    work, whole = (sum(w) for w in zip(*((p.work, p.reference_work) for p in plans), strict=True))
    yield (
        f"{names}: promised {max(p.promised_dn for p in plans):.2g} of {plans[0].tolerance_dn:g} DN, "
        f"about {work:.2g} s (everything on: {whole:.2g})"
    )
    if not_kept := [p for p in plans if not p.kept]:
        yield (
            f"  The tolerance of {plans[0].tolerance_dn:g} DN cannot be promised over all places; "
            f"what can is {max(p.promised_dn for p in not_kept):.2g} DN."
        )
    width = max(map(len, EFFECTS))
    for choices in zip(*(plan.choices for plan in plans), strict=True):
        choice = max(choices, key=lambda c: c.promised_dn)
        yield f"  {choice.effect:<{width}}  {choice.method:<16}  {choice.promised_dn:>8.2g} DN  {choice.reason}"
    if explain:
        for effect, method, promised in plans[0].rejected:
            yield f"  rejected: {effect} = {method}, by which a CSD may change by {promised:.3g} DN or more"
    yield ""
