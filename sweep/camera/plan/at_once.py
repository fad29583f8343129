"""Scenes in which everything on takes less than to look for what can be left out, as the scene alone tells."""

from __future__ import annotations

from collections.abc import Sequence

from ..effects import phase
from ..field import over_field
from ..methods import REFERENCE, Methods
from ..registry import EFFECTS
from .bounds import Box
from .plan import NOT_ASKED, Choice, Plan
from .work import LEAST_LOOK_S, LOOKING_SHARE, NOISE_S, estimated_work, in_all


def everything_on(boxes: Sequence[Box], scenario: str, tolerance_dn: float) -> Plan | float:
    """Everything on, where to look for a plan takes longer than it may; else how many seconds that may take.

    Only what the scene says by itself is left out. Of a light at any place the promise has to be known: see `Planner`.
    """
    views = [(place, box.n_designs) for box in boxes for place in over_field(box.view)]
    everything_s = in_all([(estimated_work(view, REFERENCE), n) for view, n in views])
    least_s = LEAST_LOOK_S * len(views) + NOISE_S * any(view.scenario.noise is not None for view, _ in views)
    if any(phase.all_count(view, REFERENCE) for view, _ in views) or least_s <= LOOKING_SHARE * everything_s:
        return LOOKING_SHARE * everything_s
    exact = {e: [effect.exact(view) for view, _ in views] for e, effect in EFFECTS.items()}
    choices = tuple(
        Choice(e, effect.reference, 0.0, NOT_ASKED)
        if None in exact[e]
        else Choice(e, effect.methods[0], 0.0, str(exact[e][0]))
        for e, effect in EFFECTS.items()
    )
    methods = Methods(**{choice.effect: choice.method for choice in choices})
    work = in_all([(estimated_work(view, methods), n) for view, n in views])
    return Plan(scenario, tolerance_dn, choices, work, everything_s)
