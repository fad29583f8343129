"""All filters that a study allows as a linear program, with bounds that hold for any tolerance of the solver.

A filter N lies between the least transmission and the base curve (or the box, where that reaches above it) and meets
constraints on slope and sensitivities: rows a @ N >= h(t), where t is the value that the objective is to reach. A pair
of signals with a decided side is one more row: the difference of its responses in the modified channel. Weights y >= 0
of the rows give a bound that holds for any y: a filter that reaches t has y @ A N >= y @ h(t), but no filter of the box
has more than V(y), the sum over the wavelengths of the larger of (A' y) low and (A' y) high. So no filter reaches a t
with y @ h(t) > V(y). The solver's dual values only make it tight (Neumaier and Shcherbina, "Safe bounds in linear and
mixed-integer linear programming", Math. Program. 99, 2004).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import csr_matrix, hstack, vstack

from ..base.types import Array, Float, FloatArray, IndexArray, Int, PerRow, PerValue, PerWavelength
from ..camera.linear import LinearModel, linear_model
from ..metrics.bound import FEASIBLE, Bound
from ..metrics.columns.sensitivity import SENSITIVITY
from .certificate import ROUNDING, Certificate, LinearSolution, Sides
from .cuts import Pool
from .least_noise import least_variance
from .perturbed import Distances, highest
from .problem import Problem

_SUM_ROUNDING = 1e-12
"""Rounding of a sum over rows and wavelengths, relative to the sum of its terms' sizes."""
_INSIDE_DN = 2e-7
"""Constrained distances are kept this far inside, beyond the solver's own tolerance."""
_SOLVER_TOLERANCE = 1e-10
_LEAST_WEIGHT = 1e-9
"""Weights smaller than this share of the largest one are rounding, and left out."""
_HALVINGS = 60
_SOLVED, _INFEASIBLE = 0, 2


@dataclass(frozen=True)
class _Rows:
    """Rows a @ N >= h(t) = max(least, rate t) - constant.

    `slack` is the amount by which a feasible design may be below `least`; `rate` is 0 where t does not matter.
    """

    matrix: csr_matrix
    least: PerRow
    slack: PerRow
    rate: PerRow
    constant: PerRow

    def needed(self, t: float, *, relaxed: bool = False) -> PerRow:
        """Return h(t); with `relaxed` for designs that only count as feasible."""
        least = self.least - self.slack if relaxed else self.least
        return np.asarray(np.maximum(least, np.where(self.rate > 0, self.rate * t, -np.inf)) - self.constant)


class FilterProgram:
    """Filters of a problem, and every pair of signals that may come too near."""

    def __init__(self, problem: Problem, pool: Pool | None = None) -> None:
        """Compute the rows of constraints and pairs."""
        self.problem = problem
        self._pool = pool
        self.base = problem.setup.camera.base_qe[0]
        bound = problem.constraints.get("min_transmission", Bound(min=0.0))
        least = bound.min or 0.0
        self.low, self.high = self.base * least, highest(problem)
        self._box = self.base * (least - FEASIBLE * bound.scale - ROUNDING), self.high * (1 + ROUNDING)
        self._rows, self._per_sensitivity = self._fixed_rows()
        self._set_pairs()
        objective = self._rows.rate > 0
        ends = (self._rows.matrix @ self._box[1] + self._rows.constant)[objective] / self._rows.rate[objective]
        self.top = float(min(ends.min(initial=np.inf), self.reach.max(axis=1, initial=-np.inf).min(initial=np.inf)))
        self._keep(np.flatnonzero(self.needed(max(self.top, 0.0)) > 0))
        own_sizes = np.abs(self.differences) @ self.high + np.abs(self.added).max(axis=1, initial=0.0)
        self._sizes = abs(self._rows.matrix) @ self.high, own_sizes
        self.solved = 0

    def _fixed_rows(self) -> tuple[_Rows, PerRow]:
        """Return the rows of constrained quantities that are linear in the filter.

        Also return `least` of each row relative to the least sensitivity; 0 for other rows.
        """
        matrices: list[csr_matrix] = [csr_matrix((0, self.base.size))]
        columns: list[FloatArray] = [np.empty((0, 5))]
        for quantity in sorted(self.problem.quantities.values(), key=lambda q: q.direction):  # steepness first
            bound = self.problem.constraints.get(quantity.name, Bound.model_construct(min=None, max=None))
            weight = self.problem.objective.weights.get(quantity.name)
            if quantity.linear is None or (bound.min is None and bound.max is None and weight is None):
                continue
            linear = quantity.linear(self.problem.setup)
            slack = FEASIBLE * bound.scale * linear.scale
            least = -np.inf if bound.min is None else bound.min * linear.scale
            if least > -np.inf or weight is not None:
                rate = 0.0 if weight is None else linear.scale / weight
                matrices.append(linear.rows)
                per_sensitivity = linear.scale if quantity.name == SENSITIVITY and least > -np.inf else 0.0
                coefficients = [least, slack, rate, linear.constant, per_sensitivity]
                columns.append(np.tile(coefficients, (linear.rows.shape[0], 1)))
            if bound.max is not None:
                matrices.append(-linear.rows)
                most = [-bound.max * linear.scale, slack, 0.0, -linear.constant, 0.0]
                columns.append(np.tile(most, (linear.rows.shape[0], 1)))
        *own_columns, per_sensitivities = np.concatenate(columns).T
        return _Rows(vstack(matrices).tocsr(), *own_columns), per_sensitivities

    def _distances(self) -> Iterator[tuple[str, Distances]]:
        """Yield the name and the pairs of each distance."""
        setup = self.problem.setup
        model, channel = linear_model(setup), setup.camera.modified[0]
        # Exposure does not depend on N, so the response to a filter is linear, plus what does not depend on it.
        gain = model.per_qe(0, self.base[None])[:, :, channel]
        fixed = np.delete(model.smooth(self.base[None, None])[0], channel, axis=2)
        noise = self._noise(model) if self.noisy else None
        requested = {*self.problem.objective.weights, *self.problem.constraints}
        for name, (a, b) in self.problem.pairs.items():
            if name not in requested or (self._pool is not None and name in self._pool.names):
                continue
            first, second = setup.members[a], setup.members[b]
            factors = self.problem.quantities[name].factors(setup.camera.mosaic)
            differences = factors[channel] * (gain[:, first, None] - gain[:, None, second])
            squares = (np.delete(factors, channel) * (fixed[:, first, None] - fixed[:, None, second])) ** 2
            if noise is not None and self.problem.quantities[name].distance_kind == "noise":
                # No l leaves a channel less noise than its own best one, the mean of both deviations.
                deviations = map(np.sqrt, noise)
                own_noise, others = (((of[:, first, None] + of[:, None, second]) / 2) ** 2 for of in deviations)
                differences, squares = differences / np.sqrt(own_noise)[..., None], squares / others
            others_squared = squares.sum(axis=3).ravel()
            rows = differences.reshape(-1, self.base.size)
            yield name, Distances.of(rows, others_squared)
        if self._pool is not None:
            for name in self._pool.names:
                yield name, self._pool.distances(name)

    def _set_pairs(self) -> None:
        problem = self.problem
        differences, columns = [np.empty((0, self.base.size))], [np.empty((0, 6))]
        for name, distances in self._distances():
            bound, weight = problem.constraints.get(name), problem.objective.weights.get(name)
            if weight is None and (bound is None or bound.min is None):
                continue
            differences.append(distances.rows)
            least, slack = (0.0, 0.0) if bound is None else (bound.min or 0.0, FEASIBLE * bound.scale)
            coefficients = [least, slack, 0.0 if weight is None else 1 / weight]
            columns.append(
                np.column_stack(
                    [distances.added, distances.squared, np.tile(coefficients, (distances.squared.size, 1))]
                )
            )
        self.differences = np.concatenate(differences)
        *added, self._squared, self._least, self._slack, self._rate = np.concatenate(columns).T
        self.added = np.stack(added, axis=1)
        low, high = self._box
        ends = [
            np.maximum(part, 0) @ high + np.minimum(part, 0) @ low for part in (self.differences, -self.differences)
        ]
        apart_by = np.maximum(np.stack(ends, axis=1) + self.added, 0.0)
        most = np.sqrt(self._squared[:, None] + apart_by**2) * (1 + _SUM_ROUNDING)
        reach = np.divide(most, self._rate[:, None], out=np.full(most.shape, np.inf), where=self._rate[:, None] > 0)
        self.reach = np.where(most < (self._least - self._slack)[:, None], -np.inf, reach)

    def _noise(
        self, model: LinearModel
    ) -> tuple[Float[Array, "pairs channels"], Float[Array, "pairs channels _wavelengths"]]:
        """Return the least variance in the modified channel and the others' variances, DN^2."""
        row, least = np.zeros_like(self.base), 0.0
        bound = self.problem.constraints.get(SENSITIVITY)
        if bound is not None and bound.min is not None:
            grid = model.setup.camera.grid
            row, least = grid.bins_nm / grid.integrate(self.base), bound.min - FEASIBLE * bound.scale
        others = np.delete(model.variance(self.base[None, None])[0], model.setup.camera.modified[0], axis=2)
        return least_variance(model, self.base, self._box, row, least), others

    @property
    def noisy(self) -> bool:
        """True if a distance is in units of the noise."""
        requested = {*self.problem.objective.weights, *self.problem.constraints} & self.problem.pairs.keys()
        return any(self.problem.quantities[name].distance_kind == "noise" for name in requested)

    def reaches(self, curve: PerWavelength) -> float:
        """Return the objective of a filter with the least noise, which is no less than its own."""
        pairs, rows = self._rate > 0, self._rows.rate > 0
        far = np.sqrt(self._squared + (self.differences @ curve) ** 2)[pairs] / self._rate[pairs]
        linear = (self._rows.matrix @ curve + self._rows.constant)[rows] / self._rows.rate[rows]
        return float(min(self.top, far.min(initial=np.inf), linear.min(initial=np.inf)))

    def _keep(self, subset: Int[IndexArray, " rows"]) -> None:
        self.differences, self.added, self.reach = self.differences[subset], self.added[subset], self.reach[subset]
        self._squared, self._least = self._squared[subset], self._least[subset]
        self._slack, self._rate = self._slack[subset], self._rate[subset]

    def needed(self, t: float, margin: float = 0.0, *, relaxed: bool = False) -> Float[Array, " pairs"]:
        """Return the difference in the modified channel that each pair needs to reach t, DN.

        `margin`: additional margin, in the objective's unit. 0 if none is needed.
        """
        least = self._least - self._slack if relaxed else self._least
        requested = np.maximum(least, t * self._rate)
        difference = np.sqrt(np.maximum(0.0, requested**2 - self._squared))
        inside = 0.0 if relaxed else np.where(self._least > 0, _INSIDE_DN, 0.0)
        return np.asarray(np.where(difference > 0, difference + inside + self._rate * margin, 0.0), dtype=float)

    def solve(self, t: float, sides: Sides) -> LinearSolution:
        """Find the filter with the largest margin above t, and a bound for all filters with these sides."""
        self.solved += 1
        pairs, signs = np.array(sides.pairs, dtype=np.intp), np.array(sides.signs)
        is_needed = self.needed(t)[pairs] > 0
        pairs, signs = pairs[is_needed], signs[is_needed]
        rows = vstack([self._rows.matrix, csr_matrix(signs[:, None] * self.differences[pairs])]).tocsr()
        own_added = self._added(pairs, signs)
        floor = np.concatenate([self._rows.needed(t), self.needed(t)[pairs] - own_added])
        rate = np.concatenate([self._rows.rate, self._rate[pairs]])
        status, weights, solution = self._best_margin(rows, floor, rate)
        if status == _INFEASIBLE:  # what does not depend on t cannot be met: the least that all rows must give up
            sizes = np.concatenate([self._sizes[0], self._sizes[1][pairs]])
            status, weights, solution = self._best_margin(rows, floor, sizes)
            solution = None if solution is None or solution[-1] < -ROUNDING else solution
        if weights is None:
            return LinearSolution(np.inf)
        weights[weights < _LEAST_WEIGHT * weights.max(initial=0.0)] = 0.0
        used = weights[-pairs.size :] > 0 if pairs.size else is_needed[:0]
        needs = Sides().joined(pairs[used], signs[used])
        certificate = self._certificate(weights, rows, pairs, own_added)
        beyond = self.beyond(certificate)
        if solution is None:
            return LinearSolution(beyond, needs=needs, certificate=certificate)
        return LinearSolution(beyond, float(solution[-1]), solution[:-1], needs, certificate)

    def _added(self, pairs: Int[IndexArray, " pairs"], signs: Float[Array, " pairs"]) -> PerRow:
        """Return the largest additional difference of some pairs on their side, DN."""
        return np.asarray(self.added[pairs, (signs < 0).astype(np.intp)], dtype=float)

    def differ(self, curve: PerWavelength, side: float) -> Float[Array, " pairs"]:
        """Return the largest difference of each pair on one side, DN.

        `side`: 1 with the first signal above, -1 with it below.
        """
        return np.asarray(side * (self.differences @ curve) + self.added[:, int(side < 0)], dtype=float)

    def _best_margin(self, rows: csr_matrix, floor: PerRow, rate: PerRow) -> tuple[int, PerRow | None, PerValue | None]:
        """Solve: maximize m subject to rows @ N >= floor + rate m; return status, row weights and (N, m)."""
        result = linprog(
            c=np.append(np.zeros(self.base.size), -1.0),
            A_ub=hstack([-rows, csr_matrix(rate[:, None])]).tocsr(),
            b_ub=-floor,
            bounds=np.column_stack([np.append(self.low, -np.inf), np.append(self.high, self.top + 1.0)]),
            method="highs",
            options={"primal_feasibility_tolerance": _SOLVER_TOLERANCE},
        )
        if result.status != _SOLVED:
            return int(result.status), None, None
        return _SOLVED, np.maximum(0.0, -result.ineqlin.marginals), result.x

    def _certificate(
        self, weights: PerRow, rows: csr_matrix, pairs: Int[IndexArray, " pairs"], added: Float[Array, " pairs"]
    ) -> Certificate:
        low, high = self._box
        summed = weights @ rows
        most = float(np.maximum(summed * low, summed * high).sum())
        most += _SUM_ROUNDING * float(weights @ np.concatenate([self._sizes[0], self._sizes[1][pairs]]))
        n_fixed = len(weights) - pairs.size
        most += float(weights[n_fixed:] @ added)
        used, used_pairs = np.flatnonzero(weights[:n_fixed]), np.flatnonzero(weights[n_fixed:])
        return Certificate(used, weights[used], pairs[used_pairs], weights[n_fixed:][used_pairs], most)

    def beyond(
        self, certificate: Certificate, sensitivity: float | None = None, at_least: float = 0.0, near: float = 0.0
    ) -> float:
        """Return the bound of a certificate at another sensitivity.

        `sensitivity`: least sensitivity, instead of the problem's. Returns upper bound on filters with the
        certificate's sides. Inf if the weights give none. The result may exceed the bound of the weights by `near`.
        """
        rows, per = self._rows, self._per_sensitivity
        if sensitivity is not None:
            rows = replace(rows, least=np.where(per > 0, per * sensitivity, rows.least))

        def excluded(t: float) -> bool:
            floor, needed_of_pairs = rows.needed(t, relaxed=True), self.needed(t, relaxed=True)
            requested = certificate.row_weights @ floor[certificate.rows]
            requested += certificate.pair_weights @ needed_of_pairs[certificate.pairs]
            return bool(requested > certificate.most)

        if excluded(at_least):
            return -np.inf
        if not excluded(self.top):
            return np.inf
        low_t, high_t = at_least, self.top
        for _ in range(_HALVINGS):
            if high_t - low_t <= near:
                break
            middle = (low_t + high_t) / 2
            low_t, high_t = (low_t, middle) if excluded(middle) else (middle, high_t)
        return high_t
