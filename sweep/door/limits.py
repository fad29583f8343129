"""The limit of any filter for a channel of a study, also where the study does not search."""

from __future__ import annotations

from dataclasses import replace
from typing import cast

import numpy as np

from ..camera.exposure import leaves_exposure
from ..camera.setup import Setup
from ..designs.families.stopband import Stopband
from ..designs.family import Family
from ..metrics.bound import Bound
from ..metrics.columns.sensitivity import SENSITIVITY
from ..search.limit import Limit, limit_of, why_not
from ..search.problem import Problem
from ..study import Study


def any_filter(study: Study, setup: Setup) -> Problem:
    """The problem of the best filter between nothing and the curve that it replaces, under the study's constraints."""
    base = setup.camera.base_qe[0]
    # The limit asks a family only for how large and how small its filters can be.
    family = cast(Family, Stopband(study.grid.nodes_nm, base, np.zeros_like(base)))
    low, high = (np.array([getattr(p, end) for p in family.parameters], dtype=float) for end in ("low", "high"))
    return Problem(
        setup,
        family,
        low,
        high,
        study.objective,
        study.constraints,
        edge_shift_nm=study.tolerance.edge_shift_nm,
        states=study.states,
        thickness=study.tolerance.thickness,
        own=study.own,
        vision=study.images,
    )


def at_least(problem: Problem, quantity: str, value: float) -> Problem:
    """The problem with a further lower end of a quantity."""
    old = problem.constraints.get(quantity)
    lower = value if old is None or old.min is None else max(value, old.min)
    bound = Bound(min=lower, max=None if old is None else old.max)
    return replace(problem, constraints={**problem.constraints, quantity: bound})


def as_exposed(problem: Problem) -> Problem:
    """The problem of filters that are not the brightest on white, and so leave the exposure to other pixels."""
    most = min(1.0, leaves_exposure(problem.setup))
    old = problem.constraints.get(SENSITIVITY)
    bound = Bound(
        min=None if old is None else old.min, max=most if old is None or old.max is None else min(most, old.max)
    )
    return replace(problem, constraints={**problem.constraints, SENSITIVITY: bound})


def limit_or_reason(problem: Problem) -> tuple[Limit | None, str]:
    """The limit, or why there is none."""
    reason = why_not(problem)
    return (limit_of(problem), "") if reason is None else (None, reason)
