"""The price of a worst case: the largest one at each level of what the same quantity is where nothing is off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base.types import FloatArray, Parallel, Progress, delayed
from ..metrics.columns.sensitivity import SENSITIVITY
from ..metrics.objective import Objective
from ..metrics.quantity import WORST_CASE
from .limit import Limit
from .problem import Evaluation, Problem, best_feasible
from .solver import search_from, smooth_objective
from .trade_off import Effort, FrontPoint, check_proof, with_least

_STARTS = 4


@dataclass(frozen=True)
class PricePoint:
    """A filter with its nominal quantity and its worst case; `level`: what the search kept the nominal one above.

    None for the ends: the search's answer, and the filter with the largest nominal quantity that a search found.
    `least_sensitivity`: the level of the front that both are asked for at; None: what the study asks for.
    """

    level: float | None
    best: Evaluation
    nominal: float
    worst: float
    least_sensitivity: float | None = None


def has_nominal(problem: Problem) -> bool:
    """Whether the objective is a single worst case."""
    quantity = problem.quantities.get(problem.objective.column)
    return quantity is not None and quantity.extreme == WORST_CASE


def nominal_problem(problem: Problem) -> Problem:
    """The same problem with the quantity of whose worst case its objective is, where nothing is off."""
    of = problem.quantities[problem.objective.column].of
    return replace(problem, objective=Objective(minimum={of: 1.0}))


def best_nominal(problem: Problem, answer: Evaluation, effort: Effort, parallel: Parallel) -> Evaluation | None:
    """The best design of the nominal problem, searched from a few points and from the answer to the worst case."""
    starts = [problem.to_unit(answer.x), *effort.starts[: _STARTS - 1]]
    return _best(nominal_problem(problem), starts, effort, parallel)


def searches_of_price(count: int, front: int, starts: int) -> tuple[int, int]:
    """Searches for a worst case and for a nominal quantity that a price takes, at `count` levels and `front` of light.

    Both ends are starts at each level, and what was found at the one above; the first has none above it. `starts`: of
    the search for the answer.
    """
    return max(0, 3 * count - 1), min(_STARTS, 1 + starts) * (1 + front) if count else 0


def worst_case_price(
    problem: Problem,
    answer: Evaluation,
    limit: Limit | None,
    count: int,
    effort: Effort,
    parallel: Parallel,
    progress: Progress,
) -> tuple[PricePoint, ...]:
    """The answer, the largest worst case at `count` levels between, and the filter with the largest nominal quantity.

    Each level is searched from both ends and from what was found at the level above, which keeps it, too. Raises
    BrokenProofError, see `check_proof`.
    """
    nominal = nominal_problem(problem)
    top = best_nominal(problem, answer, effort, parallel)

    def point(level: float | None, best: Evaluation) -> PricePoint:
        return PricePoint(level, best, smooth_objective(nominal, best.x), smooth_objective(problem, best.x))

    first = point(None, answer)
    if top is None or not top.objective > first.nominal:
        return (first,)
    found, above = [point(None, top)], top
    levels = np.linspace(first.nominal, top.objective, count + 2)[1:-1]
    for done, level in enumerate(map(float, levels[::-1]), 1):
        asked = with_least(problem, nominal.objective.column, level)
        ends = (answer, top) if above is top else (answer, top, above)
        best = _best(asked, [problem.to_unit(each.x) for each in ends], effort, parallel)
        check_proof(best, limit, f" at a nominal {level:g} and more")
        if best is not None:
            above = best
            found.append(point(level, best))
        progress("price of the worst case", done, count)
    return (first, *found[::-1])


def price_of_light(
    problem: Problem, front: Sequence[FrontPoint], effort: Effort, parallel: Parallel, progress: Progress
) -> tuple[PricePoint, ...]:
    """At each level of the front the filter with the largest worst case, and then the one with the most nominally."""
    nominal, found = nominal_problem(problem), list[PricePoint]()
    for done, point in enumerate(front, 1):
        if point.best is not None:
            own = with_least(problem, SENSITIVITY, point.level)
            top = best_nominal(own, point.best, effort, parallel)
            for best in (point.best, top or point.best):
                values = smooth_objective(nominal, best.x), smooth_objective(problem, best.x)
                found.append(PricePoint(None, best, *values, point.level))
        progress("the nominal front", done, len(front))
    return tuple(found)


def _best(problem: Problem, starts: Sequence[FloatArray], effort: Effort, parallel: Parallel) -> Evaluation | None:
    calls = [
        delayed(search_from, problem, i, u, effort.algorithm, effort.evaluations, effort.seed)
        for i, u in enumerate(starts)
    ]
    return best_feasible([e for run in parallel(calls) for e in run.log])
