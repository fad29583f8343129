"""What a search, its front, its limits and what is searched again will take: a little of each is tried and timed.

How many evaluations a start takes differs from study to study; the numbers here are those of the studies that come
with the package (`python -m tests.bench_estimate`).
"""

from __future__ import annotations

import time
from collections.abc import Callable

from ..base.types import FloatArray
from ..search.limit import limit_of, why_not
from ..search.problem import Problem, starting_points
from ..search.solver import GRADIENT, search_from
from ..study import Search, Study
from .held_out import LEFT_OUT_STARTS, has_nominal, left_out_signals

PER_START, PER_LEVEL = 35, 120
"""Evaluations of a start with derivatives, and of all starts at a level of the front."""
_TRIED, _PROGRAMS = 20, 20
"""Evaluations that are timed, and linear programs at most."""


def search_seconds(study: Study, search: Search) -> tuple[float, int]:
    """Seconds of one worker for the search and all that is searched with it, and about how many evaluations."""
    problem = study.problem(search)
    starts = starting_points(problem, min(search.starts, search.max_evaluations), study.section.seed)
    each = search.max_evaluations // len(starts)
    per_evaluation = _per_evaluation(problem, starts[0], search, study.section.seed)
    gradient = search.algorithm in GRADIENT
    usual = min(each, PER_START) if gradient else each
    evaluations = len(starts) * usual
    evaluations += len(search.levels) * (min(4 * each, PER_LEVEL) if gradient else 4 * each)
    if study.leaves_one_out:
        optima = 2 if has_nominal(problem) else 1
        searches = optima * len(left_out_signals(problem)) + optima - 1
        evaluations += searches * LEFT_OUT_STARTS * min(search.max_evaluations // LEFT_OUT_STARTS, usual)
    seconds = evaluations * per_evaluation
    if why_not(problem) is None:
        seconds += (1 + len(search.levels)) * _took(lambda: limit_of(problem, most_programs=_PROGRAMS))
    return seconds, evaluations


def _per_evaluation(problem: Problem, start: FloatArray, search: Search, seed: int) -> float:
    """Seconds of an evaluation, with the solver's own."""
    search_from(problem, 0, start, search.algorithm, 1, seed)  # makes the scene's kernel
    tried = []
    took = _took(lambda: tried.append(search_from(problem, 0, start, search.algorithm, _TRIED, seed)))
    return took / max(1, len(tried[0].log))


def _took(work: Callable[[], object]) -> float:
    """Seconds that something takes."""
    begun = time.monotonic()
    work()
    return time.monotonic() - begun
