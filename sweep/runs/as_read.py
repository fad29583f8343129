"""Answer of a search that meets its constraints also as the camera reads it out: rounded, clipped and noisy."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base.types import FloatArray, Progress
from ..camera.setup import Setup
from ..designs.sobol import sobol_points
from ..designs.space import Space
from ..metrics.bound import FEASIBLE, Bound, total_violation
from ..metrics.quantity import Columns
from ..search.problem import Evaluation, Problem, SearchRun, best_feasible
from ..search.solver import search_from, smooth_evaluation
from ..search.trade_off import Effort
from ..study import Search, Study
from .routes import Rules, Wanted, quantities_at

_MOST_TIGHTENED = 8
"""Searches with constraints tightened by what the readout takes from the answer before."""
_AT_ONCE = 64
"""Designs that are read out together."""
_NEAR = (0.03, 0.01, 0.003, 0.001, 0.0003)
"""Half sides of the boxes around the best design in which others are tried, as shares of the space's box."""
_ROUNDS = 3
"""Times that each of these boxes is tried, each time around the best design."""


@dataclass(frozen=True)
class Verdict:
    """Design as it is read out: least objective, largest violation, and by how much it misses each constraint."""

    objective: float
    violation: float
    missed: dict[str, float]

    @property
    def feasible(self) -> bool:
        """True if every constraint is met."""
        return self.violation <= FEASIBLE


@dataclass(frozen=True)
class Reading:
    """How the designs of a search are read out, in each of its scenarios."""

    space: Space
    setups: tuple[Setup, ...]
    rules: Rules

    @classmethod
    def of(cls, study: Study, search: Search, rules: Rules) -> Reading:
        """Return how the designs of a search are read out."""
        setups = tuple(study.setup(search.space, scenario) for scenario in search.scenarios)
        return cls(search.space, setups, rules)

    def columns(self, points: Sequence[FloatArray]) -> Iterator[Columns]:
        """Yield the values of objective and constraints in each scenario; NaN where a design fails."""
        rules, quantities = self.rules, self.rules.quantities
        names = {*rules.constraints, *rules.objective.weights, rules.objective.column}
        names |= {quantities[name].of for name in names}
        asked = {name: quantity for name, quantity in quantities.items() if name in names}
        wanted = Wanted.of(asked, rules.requested, rules.shown)
        axes = tuple(tuple(map(float, values)) for values in np.transpose(points))
        space = replace(self.space, axes=axes, listed=len(points))
        for setup in self.setups:
            yield quantities_at(space, np.arange(len(points)), setup, rules, wanted)[0]


def verdicts(reading: Reading, points: Sequence[FloatArray]) -> list[Verdict]:
    """Return the designs as they are read out; the worst of each value over the scenarios."""
    constraints, n = reading.rules.constraints, len(points)
    objective, violation, missed = np.full(n, np.inf), np.zeros(n), {name: np.zeros(n) for name in constraints}
    for columns in reading.columns(points):
        objective = np.minimum(objective, columns[reading.rules.objective.column])
        violation = np.maximum(violation, total_violation(columns, constraints, np.zeros(n)))
        for name, bound in constraints.items():
            missed[name] = np.maximum(missed[name], bound.violation(columns[name]) * bound.scale)
    return [
        Verdict(float(objective[i]), float(violation[i]), {name: float(by[i]) for name, by in missed.items()})
        for i in range(n)
    ]


def best_as_read(
    problem: Problem, reading: Reading, runs: Sequence[SearchRun], effort: Effort, progress: Progress
) -> SearchRun | None:
    """Return further evaluations, the last one of which is the best that is feasible as it is read out.

    None if that is the best of `runs`, or if no design was found: then the answer is the best before readout. Workers
    are not asked: they may be at the levels of the front.
    """
    log = [evaluation for run in runs for evaluation in run.log if evaluation.feasible]
    log = sorted({evaluation.x.tobytes(): evaluation for evaluation in log}.values(), key=lambda e: -e.objective)
    found, feasible = _tightened(problem, reading, log[0], len(runs), effort)
    if feasible and not found:
        return None
    best = found.pop() if feasible else _first_feasible(reading, log, progress)
    if best is None:
        return None
    nearby = _tried_near(problem, reading, best, effort.seed, progress)
    return SearchRun(len(runs), "as read out", [*found, best, *nearby])


def _tightened(
    problem: Problem, reading: Reading, first: Evaluation, start: int, effort: Effort
) -> tuple[list[Evaluation], bool]:
    """Search with constraints that ask for as much more as the answer before misses when it is read out.

    Returns the answers, none if the first design is feasible, and whether the last one is.
    """
    (verdict,) = verdicts(reading, [first.x])
    found, tighter, nearest = list[Evaluation](), problem, first
    while not verdict.feasible and len(found) < _MOST_TIGHTENED:
        tighter = replace(tighter, constraints=_asking_more(tighter, verdict.missed))
        algorithm = effort.refinement or effort.algorithm
        run = search_from(tighter, start, problem.to_unit(nearest.x), algorithm, effort.evaluations)
        if (inside := best_feasible(run.log)) is None:
            break
        nearest = smooth_evaluation(problem, inside.x)
        found.append(nearest)
        (verdict,) = verdicts(reading, [nearest.x])
    return found, verdict.feasible


def _first_feasible(reading: Reading, log: Sequence[Evaluation], progress: Progress) -> Evaluation | None:
    """Return the first design of a log that is feasible as it is read out."""
    for at in range(0, len(log), _AT_ONCE):
        progress("designs read out", at, len(log))
        some = log[at : at + _AT_ONCE]
        for evaluation, verdict in zip(some, verdicts(reading, [each.x for each in some]), strict=True):
            if verdict.feasible:
                return evaluation
    return None


def _tried_near(
    problem: Problem, reading: Reading, best: Evaluation, seed: int, progress: Progress
) -> list[Evaluation]:
    """Return feasible designs near one, before and after readout; each is read out as better than the last one."""
    free, found = problem.free.size, [best]
    (at_best,) = verdicts(reading, [best.x])
    boxes = np.repeat(_NEAR, _ROUNDS)
    for number, half in enumerate(boxes):
        progress("designs near the answer", number + 1, boxes.size)
        offsets = half * (2 * sobol_points(free, _AT_ONCE, seed + number) - 1)
        points = problem.from_unit(np.clip(problem.to_unit(found[-1].x) + offsets, 0.0, 1.0))
        read = verdicts(reading, list(points))
        for i in sorted(range(len(points)), key=lambda i: -read[i].objective):
            if not read[i].feasible or read[i].objective <= at_best.objective:
                continue
            evaluation = smooth_evaluation(problem, points[i])
            if evaluation.feasible:
                found.append(evaluation)
                at_best = read[i]
                break
    return found[1:]


def _asking_more(problem: Problem, missed: Mapping[str, float]) -> dict[str, Bound]:
    """Return constraints that ask for as much more as a design misses; of a probability, for as many times less."""
    constraints = dict(problem.constraints)
    for name, amount in missed.items():
        low, high = constraints[name].min, constraints[name].max
        if high is not None and problem.quantities[name].scale == "log10":
            high *= high / (high + amount)
        elif high is not None:
            high -= amount
        low = None if low is None else low + amount
        if low is None or high is None or low <= high:
            constraints[name] = Bound(min=low, max=high)
    return constraints
