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
from .work import LEAST_LOOK_S, LOOKING_SHARE, DesignCount, estimated_work, in_all, noise_s


def counted_s(views: Sequence[tuple[View, DesignCount]]) -> float:
    """Seconds of everything on, estimated; `views`: each CFA before the scene, and its designs, by its methods."""
    return in_all([(estimated_work(view, REFERENCE), designs) for view, designs in _over_field(views)])


def looking_s(views: Sequence[tuple[View, DesignCount]], everything_s: float) -> float:
    """How many seconds it may take to look for a plan; 0 where that is too short to find any.

    `views`, `everything_s`: of `counted_s`.
    """
    everywhere = any(all_heights_count(view) for view, _ in views)
    views = _over_field(views)
    found = LOOKING_SHARE * everything_s
    least_s = LEAST_LOOK_S * len(views) + max((noise_s(view) for view, _ in views), default=0.0)
    # What all places of the sensor leave open must be known.
    return found if everywhere or least_s <= found else 0.0


def everything_on(
    views: Sequence[tuple[View, DesignCount]], everything_s: float, scenario: str, tolerance_dn: float
) -> Plan:
    """Everything on, but for what the scene says by itself; `views`, `everything_s`: of `counted_s`.

    Of a light at any place no more is promised of the worst place than that its distance, as any, ends with the
    readout's range.
    """
    views = _over_field(views)
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


def _over_field(views: Sequence[tuple[View, DesignCount]]) -> list[tuple[View, DesignCount]]:
    """The same at each named place of the field."""
    return [(place, designs) for view, designs in views for place in over_field(view)]
