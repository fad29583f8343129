"""The search as a mathematical problem: box, pair, constraints; and its smooth model with derivatives."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.stats import qmc

from .arrays import FloatArray, IndexArray
from .constraints import FEASIBLE, Bound
from .evaluate import Setup, designed_quantities, response_gradient, sensitivities_gradient, smooth_response
from .families import Family
from .metrics import Pair, separation

BACK_OFF = 1e-8
"""The search keeps this far (relative) inside each bound, so that rounding does not leave its answer outside."""
_CONDITION_NM = 100.0
"""Scale of the families' own conditions, so that they weigh like the others."""


@dataclass(frozen=True)
class Problem:
    """Maximize the CSD of `pair` over the box `low`..`high` (ndarray[n_parameters]) under `constraints`.

    `constraints` maps `sensitivity` and `cfa_sensitivity` to a range, `csd_<a>_<b>` and `min_transmission` to a minimum
    and `slope_per_nm` to a maximum; `pairs` names the signal types of each constrained CSD.
    """

    setup: Setup
    family: Family
    low: FloatArray
    high: FloatArray
    pair: Pair
    constraints: Mapping[str, Bound]
    pairs: Mapping[str, Pair] = field(default_factory=dict)

    @property
    def free(self) -> IndexArray:
        """Indices of the parameters that are not fixed."""
        return np.flatnonzero(self.high > self.low)

    def from_unit(self, u: FloatArray) -> FloatArray:
        """Parameters from the free ones in units of the box: ndarray[..., n_free] -> ndarray[..., n_parameters]."""
        x = np.broadcast_to(self.low, (*u.shape[:-1], self.low.size)).copy()
        # Clipped: low + 1 * (high - low) may round to above high.
        x[..., self.free] = np.clip(
            x[..., self.free] + u * (self.high - self.low)[self.free],
            self.low[self.free],
            self.high[self.free],
        )
        return x

    def to_unit(self, x: FloatArray) -> FloatArray:
        """The free parameters in units of the box, clipped to it: [..., n_parameters] -> [..., n_free]."""
        low, span = self.low[self.free], (self.high - self.low)[self.free]
        return np.asarray(np.clip((x[..., self.free] - low) / span, 0.0, 1.0), dtype=float)


@dataclass(frozen=True)
class Evaluation:
    """One logged evaluation: parameters, smooth CSD (DN), sensitivities, largest violation (0 is feasible)."""

    x: FloatArray
    csd: float
    sensitivity: float
    cfa_sensitivity: float
    violation: float


@dataclass
class SearchRun:
    """What one start brought: the log of all evaluations, and how nlopt ended."""

    start: int
    status: str = "not started"
    log: list[Evaluation] = field(default_factory=list)


def best_feasible(log: Sequence[Evaluation]) -> Evaluation | None:
    """The feasible evaluation with the largest CSD, the earlier one on a tie; None when none is feasible."""
    feasible = [e for e in log if e.violation <= FEASIBLE and np.isfinite(e.csd)]
    return max(feasible, key=lambda e: e.csd, default=None)


def starting_points(problem: Problem, starts: int, seed: int) -> FloatArray:
    """Starting points from a scrambled Sobol set in units of the box, ndarray[starts, n_free]; one seed, one set."""
    free = problem.free
    dimensions = problem.family.start_dimensions or max(1, free.size)
    sobol = qmc.Sobol(d=dimensions, scramble=True, rng=np.random.default_rng(seed))
    points = np.asarray(sobol.random_base2(int(np.ceil(np.log2(max(2, starts)))))[:starts], dtype=float)
    if problem.family.start_dimensions is None:
        return points[:, : free.size]
    return problem.to_unit(problem.family.start(points))


@dataclass(frozen=True)
class Point:
    """Everything that one simulation gives: distances and conditions (<= 0 is met) with their derivatives by u."""

    evaluation: Evaluation
    squared: FloatArray
    squared_by_u: FloatArray
    conditions: FloatArray
    conditions_by_u: FloatArray
    amounts: Mapping[str, float]
    amounts_by_u: Mapping[str, FloatArray]


def _finite(point: Point) -> Point:
    """The point as it is, or with zeros for what is not a number: a NaN would end the search; it is never feasible."""
    arrays = (point.squared, point.squared_by_u, point.conditions, point.conditions_by_u)
    if all(np.isfinite(values).all() for values in arrays) and np.isfinite(point.evaluation.csd):
        return point
    squared, squared_by_u, conditions, conditions_by_u = (np.nan_to_num(v, posinf=0, neginf=0) for v in arrays)
    flagged = replace(point.evaluation, violation=np.inf)
    return replace(
        point,
        evaluation=flagged,
        squared=squared,
        squared_by_u=squared_by_u,
        conditions=conditions,
        conditions_by_u=conditions_by_u,
    )


class Model:
    """The smooth problem in units of the box; one simulation per point, shared by objective and constraints."""

    def __init__(self, problem: Problem, run: SearchRun, budget: int) -> None:
        self._problem = problem
        self._run = run
        self._budget = budget
        self.stop: Callable[[], object] | None = None
        self._span = (problem.high - problem.low)[problem.free]
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
        curves = problem.family.curves(x[None])
        slopes = problem.family.gradient(x)[free] * self._span[:, None, None]
        response = smooth_response(problem.setup, curves)
        by_u = response_gradient(problem.setup, curves[0], slopes)
        squared, squared_by_u = self._pair_distances(problem.pair, response[0], by_u)

        amounts = {name: float(v[0]) for name, v in designed_quantities(problem.setup, curves).items()}
        amounts_by_u = sensitivities_gradient(problem.setup, slopes)
        own = problem.family.violation(x[None])[0]
        own_by_u = problem.family.violation_gradient(x)[:, free] * self._span
        conditions, conditions_by_u = [own / _CONDITION_NM], [own_by_u / _CONDITION_NM]
        worst = float(max(own.max(initial=0.0), 0.0))
        for name, bound in problem.constraints.items():
            scale = bound.scale
            if name in problem.pairs:
                value = np.array([float(separation(response, *self._sides(problem.pairs[name]))[0])])
                d2, d2_by_u = self._pair_distances(problem.pairs[name], response[0], by_u)
                level = (bound.min or 0.0) * (1 + BACK_OFF)
                conditions.append((level**2 - d2) / scale**2)
                conditions_by_u.append(-d2_by_u / scale**2)
            elif name in ("slope_per_nm", "min_transmission"):
                value = np.array([amounts[name]])
                rows, rows_by_u = self._along_the_curve(name, bound, curves[0], slopes)
                conditions.append(rows)
                conditions_by_u.append(rows_by_u)
            else:
                value = np.array([amounts[name]])
                for end, sign in ((bound.min, -1.0), (bound.max, 1.0)):
                    if end is not None:
                        conditions.append(sign * (value - end) / scale + BACK_OFF)
                        conditions_by_u.append(sign * amounts_by_u[name][None] / scale)
            worst = max(worst, float(bound.violation(value)[0]))
        csd = float(separation(response, *self._sides(problem.pair))[0])
        evaluation = Evaluation(x, csd, amounts["sensitivity"], amounts["cfa_sensitivity"], worst)
        return Point(
            evaluation,
            squared,
            squared_by_u,
            np.concatenate(conditions),
            np.concatenate(conditions_by_u),
            amounts,
            amounts_by_u,
        )

    def _along_the_curve(
        self, name: str, bound: Bound, curves: FloatArray, slopes: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Conditions on every wavelength: ndarray[n] and their derivatives, ndarray[n, n_free].

        `curves`: ndarray[n_modified, n_wavelengths]; `slopes`: their derivatives by u, ndarray[n_free, ...].
        """
        if name == "slope_per_nm":
            limit = (bound.max or 0.0) * (1 - BACK_OFF)
            step = self._problem.setup.grid.step_nm
            steep = np.diff(curves, axis=-1).ravel() / step
            by_u = np.diff(slopes, axis=-1).reshape(len(slopes), -1).T / step
            return (
                np.concatenate([steep - limit, -steep - limit]) / bound.scale,
                np.vstack([by_u, -by_u]) / bound.scale,
            )
        base = self._problem.setup.base_qe
        floor = (bound.min or 0.0) * (1 + BACK_OFF)
        return ((floor * base - curves).ravel() / bound.scale, -slopes.reshape(len(slopes), -1).T / bound.scale)

    def _sides(self, pair: Pair) -> tuple[IndexArray, IndexArray]:
        members = self._problem.setup.members
        return members[pair[0]], members[pair[1]]

    def _pair_distances(self, pair: Pair, response: FloatArray, by_u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Squared distances of all pairs, ndarray[n_pairs], and their derivatives, ndarray[n_pairs, n_free]."""
        first, second = self._sides(pair)
        apart = (response[first, None] - response[None, second]).reshape(-1, response.shape[-1])
        apart_by_u = (by_u[:, first, None] - by_u[:, None, second]).reshape(len(by_u), *apart.shape)
        return (apart**2).sum(axis=1), 2 * (apart_by_u * apart).sum(axis=2).T
