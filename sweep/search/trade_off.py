"""The trade-off that a search traces: the best design at each level of sensitivity, and the limit there."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice, pairwise
from typing import Any

import numpy as np

from ..base.types import Call, FloatArray, Parallel, Progress, delayed
from ..metrics.bound import Bound
from ..metrics.columns.sensitivity import SENSITIVITY
from .limit import Limit, check_bound, gap_between, limit_of
from .problem import Evaluation, Problem, SearchRun, best_feasible
from .solver import search_from

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
    """The best design with at least `level` of sensitivity (None: none was found), and the limit there.

    `onward`: sensitivities up to the next level, and what no filter with at least that much exceeds.
    """

    level: float
    best: Evaluation | None
    runs: tuple[SearchRun, ...]
    limit: Limit | None
    onward: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True)
class Effort:
    """How a problem is searched: nlopt's algorithm, starting points in units of the box, ndarray[n_starts, n_free],
    evaluations of each start, and the seed of algorithms that draw.
    """

    algorithm: str
    starts: FloatArray
    evaluations: int
    seed: int


def check_proof(best: Evaluation | None, limit: Limit | None, where: str = "") -> None:
    """Raise BrokenProofError where a design that the search found is better than what is proven to be out of reach."""
    if best is not None and limit is not None:
        check_bound(best.objective, limit.proven, where)


def gap_of(best: Evaluation, limit: Limit) -> float | None:
    """Relative gap of an answer to the upper bound; None where the bound itself is within its own accuracy."""
    return None if limit.proven <= _NO_LIMIT else gap_between(best.objective, limit.proven)


def calls_at_levels(problem: Problem, levels: Sequence[float], effort: Effort, *, limited: bool) -> list[Call]:
    """The limit at each level, where the problem is `limited`, and then the first searches of each.

    None of them needs what another one finds.
    """
    if not levels:
        return []
    at_level = [with_least(problem, SENSITIVITY, level) for level in levels]
    between = _between(levels)
    around = [(*before, *after) for before, after in zip([(), *between], [*between, ()], strict=True)]
    calls = zip(at_level, around, strict=True) if limited else ()
    limits = [delayed(limit_of, p, _FRONT_LIMIT_DN, _FRONT_PROGRAMS, own) for p, own in calls]
    return [*limits, *(call for own in at_level for call in _searches(own, effort, 0, effort.starts[:_FRONT_STARTS]))]


def most_searches(n_levels: int, n_starts: int) -> int:
    """Searches of `trade_off` at most: those from a few points, and those from what each level's neighbors found."""
    return n_levels * min(n_starts, _FRONT_STARTS) + 2 * max(0, n_levels - 1)


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
    """The same search with at least each level of sensitivity: from a few points, then from what its neighbors found.

    `answers`: of `calls_at_levels`; `parallel` runs further calls over the cores. Raises BrokenProofError, see
    `check_proof`.
    """
    limits: list[Limit | None] = [*islice(answers, len(levels))] if limited else [None] * len(levels)
    runs: list[list[SearchRun]] = [[] for _ in levels]
    done, total = 0, 2 * len(levels)

    def taken(found: Iterator[SearchRun], sizes: Sequence[int]) -> None:
        nonlocal done
        for own, size in zip(runs, sizes, strict=True):
            own.extend(islice(found, size))
            done += 1
            progress("front levels", done, total)

    def best(k: int) -> Evaluation | None:
        return best_feasible([e for run in runs[k] for e in run.log]) if 0 <= k < len(runs) else None

    first = len(effort.starts[:_FRONT_STARTS])
    taken(answers, [first] * len(levels))
    found = [(best(k - 1), best(k + 1)) for k in range(len(levels))]
    points = [[problem.to_unit(e.x) for e in both if e is not None] for both in found]
    at_level = [with_least(problem, SENSITIVITY, level) for level in levels]
    calls = [_searches(own, effort, first, us) for own, us in zip(at_level, points, strict=True)]
    taken(parallel(call for own in calls for call in own), [len(own) for own in calls])
    onward = [*_tangents(_between(levels), limits), ()]
    front = tuple(FrontPoint(level, best(k), tuple(runs[k]), limits[k], onward[k]) for k, level in enumerate(levels))
    for point in front:
        check_proof(point.best, point.limit, f" at a sensitivity of {point.level:g} and more")
    return front


def _searches(problem: Problem, effort: Effort, first: int, points: Iterable[FloatArray]) -> list[Call]:
    """A search from each point; `first`: the number of the first one."""
    own = effort.algorithm, effort.evaluations, effort.seed
    return [delayed(search_from, problem, at, u, *own) for at, u in enumerate(points, first)]


def _between(levels: Sequence[float]) -> list[tuple[float, ...]]:
    """Sensitivities between each two levels."""
    return [tuple(map(float, np.linspace(a, b, _BETWEEN + 2)[1:-1])) for a, b in pairwise(levels)]


def _tangents(
    between: Sequence[tuple[float, ...]], limits: Sequence[Limit | None]
) -> Iterator[tuple[tuple[float, float], ...]]:
    """Of each two levels the smaller bound of both proofs, at the sensitivities between them."""
    for own, (below, above) in zip(between, pairwise(limits), strict=True):
        if below is None or above is None:
            yield ()
            continue
        first, second = below.elsewhere[len(below.elsewhere) - len(own) :], above.elsewhere[: len(own)]
        yield tuple(zip(own, map(min, first, second), strict=True))


def with_least(problem: Problem, name: str, level: float) -> Problem:
    """The problem with a quantity of `level` or more; a largest value that is smaller than that is given up."""
    given = problem.constraints.get(name)
    top = None if given is None or given.max is None or given.max < level else given.max
    return replace(problem, constraints={**problem.constraints, name: Bound(min=level, max=top)})
