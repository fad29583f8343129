"""Trade-off of the search: the best design at each level of sensitivity, and the upper bound there."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice, pairwise
from typing import Any

import numpy as np

from ..base.types import Array, Call, Float, Parallel, Progress, delayed
from ..metrics.bound import Bound
from ..metrics.columns.sensitivity import SENSITIVITY
from .problem import Evaluation, Problem, SearchRun, best_feasible
from .solver import search_from
from .upper_bound import UpperBound, check_bound, gap_between, upper_bound_of

_FRONT_STARTS = 2
_FRONT_LIMIT_DN = 0.02
_FRONT_PROGRAMS = 1000
"""Linear programs for the limit at each level; a level of the built-in studies takes about ten."""
_BETWEEN = 5
"""Sensitivities between two levels at which the limit is told."""
_NO_LIMIT = 0.05
"""A limit of no more than this is no more than its own accuracy."""


@dataclass(frozen=True)
class FrontPoint:
    """Best design with at least one level of sensitivity.

    `best`: best design; None if none was found.
    """

    level: float
    best: Evaluation | None
    runs: tuple[SearchRun, ...]
    upper_bound: UpperBound | None
    onward: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True)
class Effort:
    """Effort of a search.

    `evaluations`: simulations of each start at most.
    """

    algorithm: str
    starts: Float[Array, "starts free"]
    evaluations: int
    seed: int
    refinement: str | None = None


def check_proof(best: Evaluation | None, limit: UpperBound | None, where: str = "") -> None:
    """Raise an error if a design of the search exceeds the upper bound.

    Raises UpperBoundExceededError if it does.
    """
    if best is not None and limit is not None:
        check_bound(best.objective, limit.proven, where)


def gap_of(best: Evaluation, limit: UpperBound) -> float | None:
    """Return the relative gap of an answer to the upper bound.

    None if the bound is within its own accuracy of 0.
    """
    return None if limit.proven <= _NO_LIMIT else gap_between(best.objective, limit.proven)


def calls_at_levels(problem: Problem, levels: Sequence[float], effort: Effort, *, limited: bool) -> list[Call]:
    """Return the independent calls: the upper bound and the first searches at each level."""
    if not levels:
        return []
    at_level = [with_least(problem, SENSITIVITY, level) for level in levels]
    between = _between(levels)
    around = [(*before, *after) for before, after in zip([(), *between], [*between, ()], strict=True)]
    calls = zip(at_level, around, strict=True) if limited else ()
    limits = [delayed(upper_bound_of, p, _FRONT_LIMIT_DN, _FRONT_PROGRAMS, level_problem) for p, level_problem in calls]
    return [
        *limits,
        *(
            call
            for level_problem in at_level
            for call in _searches(level_problem, effort, 0, effort.starts[:_FRONT_STARTS])
        ),
    ]


def most_searches(n_levels: int, n_starts: int, *, refined: bool) -> int:
    """Return the largest number of searches of `trade_off`."""
    return n_levels * (min(n_starts, _FRONT_STARTS) + refined) + 2 * max(0, n_levels - 1)


def trade_off(
    problem: Problem,
    levels: Sequence[float],
    effort: Effort,
    answers: Iterator[Any],
    parallel: Parallel,
    progress: Progress,
    *,
    limited: bool,
) -> tuple[FrontPoint, ...]:
    """Search at each level of sensitivity: from a few points, then from the answers of neighboring levels.

    A refinement begins at the level's own answer, too.

    Returns one point per level. Raises UpperBoundExceededError if a design exceeds its upper bound.
    """
    limits: list[UpperBound | None] = [*islice(answers, len(levels))] if limited else [None] * len(levels)
    runs: list[list[SearchRun]] = [[] for _ in levels]
    done, total = 0, 2 * len(levels)

    def taken(neighbors_of: Iterator[SearchRun], sizes: Sequence[int]) -> None:
        nonlocal done
        for calls_of_level, size in zip(runs, sizes, strict=True):
            calls_of_level.extend(islice(neighbors_of, size))
            done += 1
            progress("front levels", done, total)

    def best(k: int) -> Evaluation | None:
        return best_feasible([e for run in runs[k] for e in run.log]) if 0 <= k < len(runs) else None

    first = len(effort.starts[:_FRONT_STARTS])
    taken(answers, [first] * len(levels))
    own = [best(k) if effort.refinement else None for k in range(len(levels))]
    neighbors_of = [(best(k - 1), own[k], best(k + 1)) for k in range(len(levels))]
    points = [[problem.to_unit(e.x) for e in neighbors if e is not None] for neighbors in neighbors_of]
    effort = replace(effort, algorithm=effort.refinement or effort.algorithm)
    at_level = [with_least(problem, SENSITIVITY, level) for level in levels]
    calls = [_searches(calls_of_level, effort, first, us) for calls_of_level, us in zip(at_level, points, strict=True)]
    taken(
        parallel(call for calls_of_level in calls for call in calls_of_level),
        [len(calls_of_level) for calls_of_level in calls],
    )
    onward = [*_tangents(_between(levels), limits), ()]
    front = tuple(FrontPoint(level, best(k), tuple(runs[k]), limits[k], onward[k]) for k, level in enumerate(levels))
    for point in front:
        check_proof(point.best, point.upper_bound, f" at a sensitivity of {point.level:g} and more")
    return front


def _searches(problem: Problem, effort: Effort, first: int, points: Iterable[Float[Array, " _free"]]) -> list[Call]:
    """Return the call of a search from each point; `first` is the number of the first one."""
    settings = effort.algorithm, effort.evaluations, effort.seed
    return [delayed(search_from, problem, at, u, *settings) for at, u in enumerate(points, first)]


def _between(levels: Sequence[float]) -> list[tuple[float, ...]]:
    """Return sensitivities between neighboring levels."""
    return [tuple(map(float, np.linspace(a, b, _BETWEEN + 2)[1:-1])) for a, b in pairwise(levels)]


def _tangents(
    between: Sequence[tuple[float, ...]], limits: Sequence[UpperBound | None]
) -> Iterator[tuple[tuple[float, float], ...]]:
    """Yield the smaller bound of both neighboring proofs at the sensitivities between them."""
    for levels, (below, above) in zip(between, pairwise(limits), strict=True):
        if below is None or above is None:
            yield ()
            continue
        first, second = below.elsewhere[len(below.elsewhere) - len(levels) :], above.elsewhere[: len(levels)]
        yield tuple(zip(levels, map(min, first, second), strict=True))


def with_least(problem: Problem, name: str, level: float) -> Problem:
    """Return the problem with a least value of a quantity; a smaller upper bound on it is dropped."""
    given = problem.constraints.get(name)
    top = None if given is None or given.max is None or given.max < level else given.max
    return replace(problem, constraints={**problem.constraints, name: Bound(min=level, max=top)})
