"""Scenes in which everything on takes less than to look for what can be left out, as the scene alone tells."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ..effects import phase
from ..effects.image_height import all_heights_count
from ..field import over_field
from ..methods import REFERENCE
from ..registry import EFFECTS
from ..view import View
from .plan import NOT_ASKED, Choice, Plan
from .work import LEAST_LOOK_S, LOOKING_SHARE, estimated_work, in_all, noise_s


def everything_on(views: Sequence[tuple[View, int]], scenario: str, tolerance_dn: float) -> Plan | float:
    """Everything on, where to look for a plan takes longer than it may; else how many seconds that may take.

    `views`: each CFA before the scene, and its number of designs, by the methods of the reference.
    Only what the scene says by itself is left out. Of a light at any place no more is promised of the worst place than
    that its distance, as any, ends with the readout's range.
    """
    everywhere = any(all_heights_count(view) for view, _ in views)
    views = [(place, n) for view, n in views for place in over_field(view)]
    everything_s = in_all([(estimated_work(view, REFERENCE), n) for view, n in views])
    least_s = LEAST_LOOK_S * len(views) + max((noise_s(view) for view, _ in views), default=0.0)
    if everywhere or least_s <= LOOKING_SHARE * everything_s:  # what all places of the sensor leave open must be known
        return LOOKING_SHARE * everything_s
    exact = {e: [effect.exact(view) for view, _ in views] for e, effect in EFFECTS.items()}
    longest = (math.sqrt(len(view.mosaic.channels)) * view.pixel.full_scale_dn for view, _ in views)
    open_dn = max(longest, default=0.0) * any(phase.all_count(view, REFERENCE) for view, _ in views)
    choices = tuple(
        Choice(e, effect.reference, open_dn if effect.is_limit else 0.0, NOT_ASKED)
        if None in exact[e]
        else Choice(e, effect.methods[0], 0.0, str(exact[e][0]))
        for e, effect in EFFECTS.items()
    )
    return Plan(scenario, tolerance_dn, choices, everything_s, everything_s)
