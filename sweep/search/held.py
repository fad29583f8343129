"""Search of a problem in which some parameters are held at values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from .problem import Evaluation, Problem
from .solver import search_from

_STARTS = (0.02, 0.3)
"""Shares of the box of what is free that a search begins at: of some colorants none is better than much."""


def fix_parameters(problem: Problem, values: Mapping[int, float]) -> Problem:
    """Return the problem with parameters held at values."""
    low, high = problem.low.copy(), problem.high.copy()
    for index, value in values.items():
        low[index] = high[index] = value
    return replace(problem, low=low, high=high)


def search_held(problem: Problem, algorithm: str, max_evaluations: int, seed: int) -> Evaluation:
    """Search what is free, from two starts."""
    starts = [np.full(problem.free.size, share) for share in _STARTS]
    runs = [search_from(problem, i, u0, algorithm, max_evaluations, seed) for i, u0 in enumerate(starts)]
    return max((evaluation for run in runs for evaluation in run.log), key=lambda evaluation: evaluation.rank)
