"""The smooth model of a search problem with exact derivatives: unquantized, unclipped, one simulation per point.

Every quantity is written as rows of smooth functions: a CSD is the root of the smallest of its squared pair distances,
a slope the largest of the curve's differences. A solver takes the rows, so nothing that it sees has a kink.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..camera.imager import Imager, smooth_imager
from ..curves.lights import Pair
from ..metrics.bound import FEASIBLE, Bound
from ..metrics.evaluate import WORST, designed_quantities, sensitivities_gradient
from ..types import FloatArray, IndexArray
from .problem import Evaluation, Problem, SearchRun

BACK_OFF = 1e-8
"""The search keeps this far (relative) inside each bound, so that rounding does not leave its answer outside."""
_ON_BOUND = -0.5 * FEASIBLE
"""The same where nothing lies inside, such as a slope of 0: half of what still counts as feasible."""
_MOST = {"min_transmission": 1.0, "sensitivity": 1.0}
"""What a quantity reaches at most when a filter replaces a curve that it does not exceed."""
_CONDITION_NM = 100.0
"""Scale of the families' own conditions, so that they weigh like the others."""


@dataclass(frozen=True)
class Rows:
    """Smooth functions at a point, ndarray[n], with their derivatives by u, ndarray[n, n_free]."""

    values: FloatArray
    by_u: FloatArray

    def scaled(self, factor: float, offset: float = 0.0) -> Rows:
        """factor x rows + offset."""
        return Rows(factor * self.values + offset, factor * self.by_u)

    @staticmethod
    def joined(parts: list[Rows]) -> Rows:
        """All rows, in order."""
        return Rows(np.concatenate([p.values for p in parts]), np.concatenate([p.by_u for p in parts]))

    @property
    def finite(self) -> bool:
        """Whether all of it is numbers."""
        return bool(np.isfinite(self.values).all() and np.isfinite(self.by_u).all())

    def cleaned(self) -> Rows:
        """Zeros for what is not a number."""
        return Rows(*(np.nan_to_num(v, posinf=0, neginf=0) for v in (self.values, self.by_u)))


@dataclass(frozen=True)
class Point:
    """Everything that one simulation gives.

    `terms`: the objective's weighted quantities, squared, as rows; `term`: ndarray[n], the term that each row belongs
    to (all 0 for a minimum). `conditions`: met where <= 0. `quantities`: rows of each constrained quantity.
    """

    evaluation: Evaluation
    terms: Rows
    term: IndexArray
    conditions: Rows
    quantities: Mapping[str, Rows]

    @property
    def term_values(self) -> FloatArray:
        """Value of each term, ndarray[n_terms]."""
        return np.sqrt([self.terms.values[self.term == k].min() for k in range(int(self.term.max()) + 1)])


def _finite(point: Point) -> Point:
    """The point as it is, or with zeros for what is not a number: a NaN would end the search; it is never feasible."""
    if point.terms.finite and point.conditions.finite and np.isfinite(point.evaluation.objective):
        return point
    return replace(
        point,
        evaluation=replace(point.evaluation, violation=np.inf),
        terms=point.terms.cleaned(),
        conditions=point.conditions.cleaned(),
        quantities={name: rows.cleaned() for name, rows in point.quantities.items()},
    )


def is_distance(quantity: str) -> bool:
    """Whether a quantity is a CSD, whose rows are squared distances."""
    return quantity.removeprefix(WORST).startswith("csd_")


class _Simulation:
    """One design, as it comes out with its edges shifted, with derivatives by the free parameters."""

    def __init__(self, imager: Imager, curves: FloatArray, by_u: FloatArray) -> None:
        self._imager = imager
        self._setup = setup = imager.setup
        self._curves = curves
        self._by_u = by_u
        self.amounts = {name: float(v[0]) for name, v in designed_quantities(setup, curves[None]).items()}

    @cached_property
    def _response(self) -> tuple[FloatArray, FloatArray]:
        curves = self._curves
        return self._imager.smooth(curves[None])[0], self._imager.smooth_gradient(curves, self._by_u)

    def squared(self, pair: Pair) -> Rows:
        """Squared distances of all pairs of signals of two types, in every case."""
        response, by_u = self._response
        first, second = (self._setup.members[name] for name in pair)
        apart = (response[:, first, None] - response[:, None, second]).reshape(-1, response.shape[-1])
        apart_by_u = (by_u[:, :, first, None] - by_u[:, :, None, second]).reshape(len(by_u), *apart.shape)
        return Rows((apart**2).sum(axis=1), 2 * (apart_by_u * apart).sum(axis=2).T)

    def sensitivity(self, name: str) -> Rows:
        """One of the sensitivities: one row."""
        by_u = sensitivities_gradient(self._setup, self._by_u)[name]
        return Rows(np.array([self.amounts[name]]), by_u[None])

    def slope(self) -> Rows:
        """Up and down slopes at every wavelength, 1/nm."""
        step = self._setup.grid.step_nm
        steep = np.diff(self._curves, axis=-1).ravel() / step
        by_u = np.diff(self._by_u, axis=-1).reshape(len(self._by_u), -1).T / step
        return Rows(np.concatenate([steep, -steep]), np.vstack([by_u, -by_u]))

    def transmission(self) -> Rows:
        """Curve over base at every wavelength where there is a base."""
        base = self._setup.base_qe.ravel()
        some = base > 0
        by_u = self._by_u.reshape(len(self._by_u), -1).T
        return Rows(self._curves.ravel()[some] / base[some], by_u[some] / base[some, None])


class Model:
    """The smooth problem in units of the box; one simulation per point, shared by objective and constraints."""

    def __init__(self, problem: Problem, run: SearchRun, budget: int) -> None:
        self._problem = problem
        self._imager = smooth_imager(problem.setup)
        self._run = run
        self._budget = budget
        self.stop: Callable[[], object] | None = None
        self._span = (problem.high - problem.low)[problem.free]
        wanted = (*problem.objective.weights, *problem.constraints)
        shifts = dict.fromkeys(s for name in ("nominal", *wanted) for s in problem.shifts_nm(name))
        self._families = {s: problem.family.shifted(s) if s else problem.family for s in shifts}
        self._back_off = {name: _back_off(problem, name, bound) for name, bound in problem.constraints.items()}
        self._seen: dict[bytes, Point] = {}

    def at(self, u: FloatArray) -> Point:
        """The simulation at `u`, made and logged once; past the budget it stops the search that uses this model."""
        # A copy, since `u` is nlopt's own buffer.
        u = np.clip(np.array(u, dtype=float), 0.0, 1.0)
        key = u.tobytes()
        if key not in self._seen and len(self._run.log) >= self._budget and self.stop is not None:
            self.stop()
            return next(iter(self._seen.values()))
        if key not in self._seen:
            # Only the newest is asked for again: the constraints follow the objective at the same point.
            # A filter without light has no exposure.
            with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
                self._seen = {key: _finite(self._simulate(u))}
            self._run.log.append(self._seen[key].evaluation)
        return self._seen[key]

    def _simulate(self, u: FloatArray) -> Point:
        problem, free = self._problem, self._problem.free
        x = problem.from_unit(u)
        made = {
            shift: _Simulation(
                self._imager, family.curves(x[None])[0], family.gradient(x)[free] * self._span[:, None, None]
            )
            for shift, family in self._families.items()
        }
        terms, objective = self._terms(made, x)
        own = problem.family.violation(x[None])[0]
        conditions = [Rows(own, problem.family.violation_gradient(x)[:, free] * self._span).scaled(1 / _CONDITION_NM)]
        worst = float(max(own.max(initial=0.0), 0.0))
        quantities = {}
        for name, bound in problem.constraints.items():
            rows = quantities[name] = self._rows(name, made, x)
            conditions += _conditions(name, bound, rows, self._back_off[name])
            worst = max(worst, float(bound.violation(np.array([_value(name, rows)]))[0]))
        amounts = made[0.0].amounts
        evaluation = Evaluation(x, objective, amounts["sensitivity"], amounts["cfa_sensitivity"], worst)
        own_term = np.arange(len(terms)) if problem.objective.rule == "sum" else np.zeros(len(terms), dtype=int)
        term = np.repeat(own_term, [rows.values.size for rows in terms])
        return Point(evaluation, Rows.joined(terms), term, Rows.joined(conditions), quantities)

    def _terms(self, made: Mapping[float, _Simulation], x: FloatArray) -> tuple[list[Rows], float]:
        """The squared rows of each weighted quantity of the objective, and the objective's value."""
        terms, columns = [], {}
        for name, weight in self._problem.objective.weights.items():
            rows = self._rows(name, made, x)
            columns[name] = np.array([_value(name, rows)])
            if not is_distance(name):
                rows = Rows(rows.values**2, 2 * rows.values[:, None] * rows.by_u)
            terms.append(rows.scaled(weight**2))
        return terms, float(self._problem.objective.of(columns)[0])

    def _rows(self, name: str, made: Mapping[float, _Simulation], x: FloatArray) -> Rows:
        """The rows whose smallest (of a slope: largest; of a CSD: root of the smallest) is the quantity."""
        problem = self._problem
        if name in problem.family.dimensions:
            matrix = problem.family.dimensions[name]
            return Rows(matrix @ x, matrix[:, problem.free] * self._span)
        plain = name.removeprefix(WORST)
        found = []
        for shift in problem.shifts_nm(name):
            simulation = made[shift]
            if plain in problem.pairs:
                found.append(simulation.squared(problem.pairs[plain]))
            elif plain == "slope_per_nm":
                found.append(simulation.slope())
            elif plain == "min_transmission":
                found.append(simulation.transmission())
            else:
                found.append(simulation.sensitivity(plain))
        return Rows.joined(found)


def _value(name: str, rows: Rows) -> float:
    """The quantity from its rows."""
    if name == "slope_per_nm":
        return float(rows.values.max())
    return float(np.sqrt(rows.values.min()) if is_distance(name) else rows.values.min())


def _back_off(problem: Problem, name: str, bound: Bound) -> float:
    """How far inside a bound to keep, relative: not at all where it is the end of what the quantity can be."""
    most = _MOST.get(name.removeprefix(WORST), np.inf)
    if name in problem.family.dimensions:
        rows = problem.family.dimensions[name]
        most = float((np.maximum(rows, 0) @ problem.high + np.minimum(rows, 0) @ problem.low).min())
    at_end = bound.max == 0 or (bound.min is not None and bound.min + BACK_OFF * bound.scale > most)
    return _ON_BOUND if at_end else BACK_OFF


def _conditions(name: str, bound: Bound, rows: Rows, back_off: float) -> list[Rows]:
    """Rows that are <= 0 where the bound is kept, `back_off` inside, relative to its scale."""
    found, scale = [], bound.scale
    if bound.min is not None and is_distance(name):
        found.append(rows.scaled(-1 / scale**2, (bound.min * (1 + back_off) / scale) ** 2))
    elif bound.min is not None:
        found.append(rows.scaled(-1 / scale, bound.min / scale + back_off))
    if bound.max is not None:
        found.append(rows.scaled(1 / scale, -bound.max / scale + back_off))
    return found
