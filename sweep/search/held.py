"""Search of a problem in which some parameters are held at values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..metrics.bound import FEASIBLE
from .problem import Evaluation, Problem, best_feasible
from .solver import search_from

_STARTS = (0.02, 0.3)
"""Shares of the box of what is free that a search begins at: of some colorants none is better than much."""


@dataclass(frozen=True)
class Held:
    """Best evaluation with held parameters, the best feasible one, else the least infeasible one, and their number."""

    best: Evaluation
    evaluations: int

    @property
    def feasible(self) -> bool:
        """True if the best evaluation meets every constraint."""
        return self.best.violation <= FEASIBLE

    @property
    def rank(self) -> tuple[bool, float]:
        """What the best of several has most of."""
        return self.feasible, self.best.objective if self.feasible else -self.best.violation


def held_at(problem: Problem, values: Mapping[int, float]) -> Problem:
    """Return the problem with parameters held at values.

    Parameters
    ----------
    problem : Problem
        Search problem.
    values : mapping of int to float
        Index of a parameter to its value.

    Returns
    -------
    Problem
        Problem with fewer free parameters.
    """
    low, high = problem.low.copy(), problem.high.copy()
    for index, value in values.items():
        low[index] = high[index] = value
    return replace(problem, low=low, high=high)


def search_held(problem: Problem, algorithm: str, max_evaluations: int, seed: int) -> Held:
    """Search what is free, from two starts.

    Parameters
    ----------
    problem : Problem
        Search problem; nothing need be free.
    algorithm : str
        Algorithm of nlopt.
    max_evaluations : int
        Evaluations of each start at most.
    seed : int
        Seed.

    Returns
    -------
    Held
        Result.
    """
    starts = [np.full(problem.free.size, share) for share in _STARTS]
    runs = [search_from(problem, i, u0, algorithm, max_evaluations, seed) for i, u0 in enumerate(starts)]
    log = [evaluation for run in runs for evaluation in run.log]
    return Held(best_feasible(log) or min(log, key=lambda evaluation: evaluation.violation), len(log))


def search_cells(
    problem: Problem, cells: Sequence[Mapping[int, float]], algorithm: str, max_evaluations: int, seed: int
) -> list[Held]:
    """Search what is free with other parameters held at the values of each cell.

    Parameters
    ----------
    problem : Problem
        Search problem.
    cells : sequence of mapping of int to float
        Index of a parameter to its value.
    algorithm : str
        Algorithm of nlopt.
    max_evaluations : int
        Evaluations of each start at most.
    seed : int
        Seed.

    Returns
    -------
    list of Held
        Results, in order.
    """
    return [search_held(held_at(problem, cell), algorithm, max_evaluations, seed) for cell in cells]
