"""Smooth model of a search problem with exact derivatives: unquantized, unclipped, one simulation per point.

Every quantity is written as rows of smooth functions: a CSD is the root of the smallest of its squared pair distances,
a slope the largest of the curve's differences, an error the one with the fewest decades below 1. The solver uses the
rows, so that all its functions are smooth.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ..base.types import FloatArray, IndexArray, Int, PerFree, PerTerm
from ..camera.linear import linear_model
from ..camera.setup import Setup
from ..designs.tolerance import AS_DESIGNED, ProductionError
from ..metrics.bound import FEASIBLE, Bound
from ..metrics.columns.sensitivity import CFA_SENSITIVITY, SENSITIVITY, light_of
from ..metrics.quantity import Quantity
from ..metrics.rule import Rule
from ..metrics.smooth import Rows, SmoothDesign
from .problem import Evaluation, Problem, SearchRun

if TYPE_CHECKING:
    from ..metrics.drawn import Sample
    from ..metrics.members import PopulationModel

BACK_OFF = 1e-8
"""The search keeps this far (relative) inside each bound, so that rounding does not leave its answer outside."""
_ON_BOUND = -0.5 * FEASIBLE
"""The same where nothing lies inside, such as a slope of 0: half of what still counts as feasible."""
_SETTLED, _SETTLED_EVALUATIONS = 1e-6, 16
"""A search whose latest evaluations all lie within this share of the box, with objectives within this share of their
size and violations as near, has converged: further steps are below rounding. SLSQP's line
searches take ten steps, so it has begun anew without coming away from there.
"""
_CONDITION_NM = 100.0
"""Scale of the families' own conditions, so that they weigh like the others."""


@dataclass(frozen=True)
class Point:
    """Result of one simulation.

    `terms`: rows of the objective's weighted quantities: squared, as they are if they may be negative, or as decades
    below 1; `power`: 2 for squared rows, else 1; `term`: term of each row (all 0 for a minimum); `conditions`: met
    where <= 0.
    """

    evaluation: Evaluation
    terms: Rows
    power: int
    term: Int[IndexArray, " terms"]
    conditions: Rows
    quantities: Mapping[str, Rows]

    @property
    def term_values(self) -> PerTerm:
        """Value of each term."""
        least = [self.terms.values[self.term == k].min() for k in range(int(self.term.max()) + 1)]
        return np.sqrt(least) if self.power == 2 else np.array(least)


def _members_of(setup: Setup) -> PopulationModel:
    from ..metrics.members import population_model  # noqa: PLC0415  (only where lights have a population)

    return population_model(setup)


def _drawn_of(problem: Problem, setup: Setup) -> Sample:
    from ..metrics.drawn_sensors import searched_sample  # noqa: PLC0415  (only where a share of cameras counts)

    return searched_sample(setup, problem.tolerance, problem.seed)


def _finite(point: Point) -> Point:
    """Return the point with zeros for NaN, which would end the search; it is never feasible."""
    if point.terms.finite and point.conditions.finite and np.isfinite(point.evaluation.objective):
        return point
    return replace(
        point,
        evaluation=replace(point.evaluation, violation=np.inf),
        terms=point.terms.without_nan(),
        conditions=point.conditions.without_nan(),
        quantities={name: rows.without_nan() for name, rows in point.quantities.items()},
    )


class Model:
    """Smooth problem in units of the box; objective and constraints share one simulation of each scenario per point."""

    def __init__(self, problem: Problem, run: SearchRun, budget: int) -> None:
        self._problem = problem
        self._quantities = problem.quantities
        self._run = run
        self._budget = budget
        self.stop: Callable[[], object] | None = None
        self.spent = self.lost = False
        self._latest: deque[FloatArray] = deque(maxlen=_SETTLED_EVALUATIONS)
        self._span = (problem.high - problem.low)[problem.free]
        self._free = problem.free
        self._rule, self._weights = problem.objective.rule, problem.objective.weights
        requested = (*self._weights, *problem.constraints)
        self._perturbed = {name: problem.perturbed(name) for name in requested}
        errors = dict.fromkeys(
            (AS_DESIGNED, *(production_error for every in self._perturbed.values() for production_error in every))
        )
        over = any(problem.over_population(name) for name in requested)
        of_a_share = any(problem.of_a_share(name) for name in requested)
        self._errors = tuple(errors)
        self._scenes = [
            (
                linear_model(setup),
                {
                    production_error: family.perturbed(production_error) if any(production_error) else family
                    for production_error in errors
                },
                _members_of(setup) if over else None,
                _drawn_of(problem, setup) if of_a_share else None,
            )
            for setup, family in problem.scenes
        ]
        wanted_less = self._rule.direction == "less"
        self._power = 1 if problem.signed_goal or wanted_less else 2  # a quantity that may be negative has no root
        self._back_off = {name: _back_off(problem, name, bound) for name, bound in problem.constraints.items()}
        self._points: dict[bytes, Point] = {}

    def at(self, u: PerFree) -> Point:
        """Simulate and log a point once; beyond the budget, or where `u` is NaN, stop the search."""
        # A copy, since `u` is nlopt's own buffer.
        u = np.clip(np.array(u, dtype=float), 0.0, 1.0)
        key = u.tobytes()
        if self._points and self.stop is not None and not np.isfinite(u).all():
            self.stop()
            self.lost = True
            return next(iter(self._points.values()))
        if key not in self._points and len(self._run.log) >= self._budget and self.stop is not None:
            self.stop()
            self.spent = True
            return next(iter(self._points.values()))
        if key not in self._points:
            # Only the newest is asked for again: the constraints follow the objective at the same point.
            # A filter without light has no exposure.
            with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
                self._points = {key: _finite(self._simulate(u))}
            self._run.log.append(self._points[key].evaluation)
            self._latest.append(u)
        return self._points[key]

    @property
    def settled(self) -> bool:
        """True if the latest evaluations are at one point with one value."""
        latest = self._latest
        if len(latest) < _SETTLED_EVALUATIONS or (np.abs(latest[-1] - latest[0]) > _SETTLED).any():
            return False
        log = self._run.log[-_SETTLED_EVALUATIONS:]
        worth, violations = [e.objective for e in log], [e.violation for e in log]
        near = max(worth) - min(worth) <= _SETTLED * max(map(abs, worth))
        near = near and max(violations) - min(violations) <= _SETTLED
        return near and bool((np.ptp(np.stack(latest), axis=0) <= _SETTLED).all())

    def _simulate(self, u: PerFree) -> Point:
        problem, free = self._problem, self._free
        x = problem.from_unit(u)
        simulated = {
            production_error: [
                SmoothDesign(model, families[production_error], x, free, self._span, members, drawn)
                for model, families, members, drawn in self._scenes
            ]
            for production_error in self._errors
        }
        terms, objective = self._terms(simulated)
        violations = problem.family.violation(x[None])[0]
        conditions = [
            Rows(violations, problem.family.violation_gradient(x)[:, free] * self._span).scaled(1 / _CONDITION_NM)
        ]
        worst = float(max(violations.max(initial=0.0), 0.0))
        quantities = {}
        for name, bound in problem.constraints.items():
            rows = quantities[name] = self._rows(name, simulated)
            conditions += _conditions(self._quantities[name], bound, rows, self._back_off[name])
            worst = max(worst, float(bound.violation(np.array([self._quantities[name].value(rows)]))[0]))
        light = light_of(simulated[AS_DESIGNED][0])
        violations, cfa_sensitivity = (float(light[name][0]) for name in (SENSITIVITY, CFA_SENSITIVITY))
        evaluation = Evaluation(x, objective, violations, cfa_sensitivity, worst)
        own_term = np.arange(len(terms)) * (not self._rule.smallest)  # what is smallest needs one bound
        term = np.repeat(own_term, [rows.values.size for rows in terms])
        return Point(evaluation, Rows.joined(terms), self._power, term, Rows.joined(conditions), quantities)

    def _terms(self, simulated: Mapping[ProductionError, list[SmoothDesign]]) -> tuple[list[Rows], float]:
        """Return the rows of the objective's weighted quantities, and its value."""
        terms, columns = [], {}
        for name, weight in self._weights.items():
            quantity, rows = self._quantities[name], self._rows(name, simulated)
            columns[name] = np.array([quantity.value(rows)])
            terms.append(_term(quantity, rows, weight, self._rule, self._power))
        if self._rule.direction == "less":  # by the decades, which do not end where numbers do
            return terms, float(min(rows.values.min() for rows in terms))
        return terms, float(self._problem.objective.of(columns)[0])

    def _rows(self, name: str, simulated: Mapping[ProductionError, list[SmoothDesign]]) -> Rows:
        """Return the rows of a quantity, in every scenario."""
        smooth = self._quantities[name].smooth
        assert smooth is not None
        n_scenes = self._problem.n_scenes_of(name)
        return Rows.joined(
            [
                smooth(design)
                for production_error in self._perturbed[name]
                for design in simulated[production_error][:n_scenes]
            ]
        )


def _term(quantity: Quantity, rows: Rows, weight: float, rule: Rule, power: int) -> Rows:
    """Return the rows of a weighted quantity in the objective."""
    if rule.direction == "less" and quantity.scale == "linear":
        rows = rows.logarithms()
    if rule.direction == "less":
        return rows.scaled(1.0, -math.log10(weight))
    if power == 1:
        return (rows.roots() if quantity.scale == "squared" else rows).scaled(weight)
    return (rows if quantity.scale == "squared" else rows.squares()).scaled(weight**2)


def _back_off(problem: Problem, name: str, bound: Bound) -> float:
    """Return the relative distance to keep from a bound; 0 if the bound is the end of the quantity's range."""
    most = problem.quantities[name].most
    if name in problem.family.dimensions:
        rows = problem.family.dimensions[name]
        most = float((np.maximum(rows, 0) @ problem.high + np.minimum(rows, 0) @ problem.low).min())
    at_end = bound.max == 0 or (bound.min is not None and bound.min + BACK_OFF * bound.scale > most)
    return _ON_BOUND if at_end else BACK_OFF


def _conditions(quantity: Quantity, bound: Bound, rows: Rows, back_off: float) -> list[Rows]:
    """Return rows that are <= 0 where a bound is met, with a relative margin of `back_off`."""
    conditions, scale = [], bound.scale
    if quantity.scale == "log10" and bound.max is not None:
        least = -math.log10(bound.max)
        return [rows.scaled(-1.0, least + back_off * max(1.0, least))]
    if bound.min is not None and quantity.scale == "squared":
        conditions.append(rows.scaled(-1 / scale**2, (bound.min * (1 + back_off) / scale) ** 2))
    elif bound.min is not None:
        conditions.append(rows.scaled(-1 / scale, bound.min / scale + back_off))
    if bound.max is not None:
        conditions.append(rows.scaled(1 / scale, -bound.max / scale + back_off))
    return conditions
