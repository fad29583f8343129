"""The physical limit: the best of all filters for one modified channel, not only those of a family.

Over all N(l) with 0 <= N <= base, a least transmission, a slope bound and the study's sensitivity, the largest t such
that every pair of a first and a second signal is at least t apart. For fixed t that is a linear program, whose margin
also bounds how much larger t can be, so a few steps on t find the global optimum. The certificate is a bracket: a
filter that attains the lower end, and a linear program that proves the upper end infeasible. What only some families
have (edges and bands, and their shifts in production) is left out: that makes the set of filters larger, so the upper
end stays true for them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import csr_matrix, diags_array, vstack

from .arrays import FloatArray
from .constraints import FEASIBLE, Bound
from .effects.saturation import top_e
from .errors import Fault, SweepError
from .evaluate import DESIGNED, WORST, designed_quantities, smooth_csd, smooth_response
from .imaging import smooth_imager
from .objectives import Objective
from .problem import Problem
from .scenes import WhitePatchExposure
from .sensor import unquantized

_MARGIN_DN = 1e-6
"""A linear program whose best margin is below minus this is infeasible beyond its solver's own tolerance."""
_SOLVER_TOLERANCE = 1e-7
"""HiGHS keeps bounds and rows up to this."""
_INSIDE_DN = 2e-7
"""Constrained distances are kept this far inside, beyond the solver's own tolerance."""
_SENSITIVITY_TOLERANCE = 1e-6
_MOST_STEPS = 80
_ROUNDING = 1e-9
_SENSITIVITIES = ("sensitivity", "cfa_sensitivity")
Signs = Mapping[str, float]
"""CSD -> which of its two signal types has the larger response in the modified channel, +1 the first, -1 the second."""


@dataclass(frozen=True)
class Limit:
    """The bracket of the limit, in the objective's unit, and the filter that attains its lower end, QE.

    `attained`: the objective for `curve` (ndarray[n_wavelengths]), evaluated like any design; no filter whose first
    signals all lie on one side of the second ones reaches `proven` or more. `curve` is None when no filter meets the
    constraints. `left_out`: what the study asks for beyond the limit's own constraints. `programs`: number of
    linear programs solved for it; `open_parts`: parts of the proof that were left open when that number ran out.
    """

    attained: float
    proven: float
    curve: FloatArray | None
    left_out: tuple[str, ...] = ()
    programs: int = 0
    open_parts: int = 0


def limit_of(problem: Problem, tolerance_dn: float = 1e-3) -> Limit:
    """The limit of a problem with one modified channel, to `tolerance_dn` (1e-6 for an objective without a CSD).

    Filters are bounded by 0 (or the least transmission) and the base curve. Raises SweepError where the program would
    not be linear; see `why_not`.
    """
    refused = why_not(problem)
    if refused is not None:
        raise SweepError(Fault(f"no limit: {refused}"))
    nominal, left_out = _relaxed(problem)
    program = _Program(nominal)
    tolerance = tolerance_dn if program.distances & set(nominal.objective.weights) else _SENSITIVITY_TOLERANCE
    sided = program.undecided
    best, proven = Limit(-np.inf, -np.inf, None), -np.inf
    for signs in product((1.0, -1.0), repeat=len(sided)):
        found = _bracket(program, dict(zip(sided, signs, strict=True)), best.attained, tolerance)
        proven = max(proven, found.proven)
        best = found if found.attained > best.attained else best
    return replace(best, proven=proven, left_out=left_out)


def why_not(problem: Problem) -> str | None:
    """Why a problem has no linear limit; None when it has."""
    for refused, reason in (
        (problem.family.n_modified != 1, "more than one modified channel"),
        (problem.objective.rule == "sum", "the objective is a sum"),
        (problem.setup.pixel.crosstalk > 0, "crosstalk mixes the modified channel into others"),
    ):
        if refused:
            return reason
    if (_top(problem) > problem.setup.base_qe[0] * (1 + _ROUNDING)).any():
        return "filters of the box may exceed the curve that they replace"
    if _clips(problem):
        return "signals exceed the full well or the range of the ADC"
    if isinstance(problem.setup.scenario.exposure, WhitePatchExposure) and not _exposure_is_fixed(problem):
        return "the modified channel could set the exposure"
    return None


def _relaxed(problem: Problem) -> tuple[Problem, tuple[str, ...]]:
    """The problem without what only families of edges have, worst cases as nominal ones; and what was left out."""
    known = (*problem.pairs, *DESIGNED)
    left_out = [name for name in problem.constraints if name.removeprefix(WORST) not in known]
    kept: dict[str, Bound] = {}
    for name, bound in problem.constraints.items():
        plain = name.removeprefix(WORST)
        if plain in known:
            ends = [b for b in (bound, kept.get(plain)) if b is not None]
            least, most = [b.min for b in ends if b.min is not None], [b.max for b in ends if b.max is not None]
            kept[plain] = Bound.model_construct(min=max(least, default=None), max=min(most, default=None))
    weights: dict[str, float] = {}
    for name, weight in problem.objective.weights.items():
        plain = name.removeprefix(WORST)
        weights[plain] = min(weight, weights.get(plain, weight))
    if any(name.startswith(WORST) for name in (*problem.constraints, *problem.objective.weights)):
        left_out.append("edge shifts")
    return replace(problem, objective=Objective(minimum=weights), constraints=kept), tuple(left_out)


def _top(problem: Problem) -> FloatArray:
    """No filter of the box exceeds this curve, ndarray[n_wavelengths]."""
    return np.asarray(problem.family.upper(problem.low, problem.high)[0], dtype=float)


def _clips(problem: Problem) -> bool:
    """Whether the base curve's response, the largest that any of the filters has, is cut off when it is read out."""
    setup = problem.setup
    smooth = smooth_response(setup, setup.base_qe[None])
    top_dn = unquantized(np.array(top_e(setup.pixel)), setup.pixel)
    return bool((smooth > top_dn).any())


def _exposure_is_fixed(problem: Problem) -> bool:
    """Whether a channel that is not modified is at least as bright on white as the base curve."""
    setup = problem.setup
    rates = setup.qe.sum(axis=1)  # the white patch is flat in photons
    kept = np.delete(rates, setup.modified)
    return bool(kept.size and kept.max() >= rates[list(setup.modified)].max())


class _Program:
    """The linear program: N between its bounds, slope, sensitivities; and what N gives for each pair of signals."""

    def __init__(self, problem: Problem) -> None:
        setup = problem.setup
        self.problem = problem
        self.base = setup.base_qe[0]
        self.low = self.base * self._least("min_transmission")
        imager, channel = smooth_imager(setup), setup.modified[0]
        response = imager.smooth(self.base[None, None])[0]
        # Exposure does not depend on N, so the response to a filter is linear, plus what does not depend on it.
        gain = imager.per_qe(0, self.base[None])[:, :, channel]
        fixed = np.delete(response, channel, axis=2)
        self.distances = {n for n in (*problem.objective.weights, *problem.constraints) if n in problem.pairs}
        self.fixed_squared: dict[str, FloatArray] = {}
        self.difference: dict[str, FloatArray] = {}
        for name in self.distances:
            first, second = (setup.members[kind] for kind in problem.pairs[name])
            self.fixed_squared[name] = ((fixed[:, first, None] - fixed[:, None, second]) ** 2).sum(axis=3).ravel()
            self.difference[name] = (gain[:, first, None] - gain[:, None, second]).reshape(-1, self.base.size)
        self._sums = self._sensitivity_rows()
        self._rows, self._limits = self._fixed_rows()

    @property
    def undecided(self) -> list[str]:
        """CSDs for which the modified channel matters, each with a side to choose."""
        weights = self.problem.objective.weights
        return [
            name
            for name in sorted(self.distances)
            if name in weights or self._least(name) ** 2 > self.fixed_squared[name].min()
        ]

    def _least(self, name: str) -> float:
        bound = self.problem.constraints.get(name)
        return 0.0 if bound is None or bound.min is None else bound.min

    def _needed(self, name: str, t: float) -> float:
        """What a quantity must reach for an objective of t."""
        weight = self.problem.objective.weights.get(name)
        return max(self._least(name), 0.0 if weight is None else t / weight)

    def _sensitivity_rows(self) -> dict[str, tuple[FloatArray, float]]:
        """Each sensitivity as (row, constant): row @ N + constant."""
        setup, size = self.problem.setup, self.base.size
        counts, modified = setup.mosaic.counts, setup.modified[0]
        whole = counts.sum() * setup.clear_qe.sum()
        others = float(np.delete(setup.qe.sum(axis=1) * counts, modified).sum())
        return {
            "sensitivity": (np.full(size, 1 / self.base.sum()), 0.0),
            "cfa_sensitivity": (np.full(size, counts[modified] / whole), others / whole),
        }

    def _fixed_rows(self) -> tuple[csr_matrix, FloatArray]:
        """Rows and right-hand sides of what does not depend on t: slope, largest sensitivities."""
        constraints, size = self.problem.constraints, self.base.size
        rows, limits = [csr_matrix((0, size))], [np.empty(0)]
        slope = constraints.get("slope_per_nm")
        if slope is not None and slope.max is not None:
            step = diags_array([-1.0, 1.0], offsets=[0, 1], shape=(size - 1, size))
            rows += [step, -step]
            limits.append(np.full(2 * (size - 1), slope.max * self.problem.setup.grid.step_nm))
        for name, (row, constant) in self._sums.items():
            bound = constraints.get(name)
            if bound is not None and bound.max is not None:
                rows.append(csr_matrix(row[None]))
                limits.append(np.array([bound.max - constant]))
        return vstack(rows).tocsr(), np.concatenate(limits)

    def best_margin(self, t: float, signs: Signs) -> tuple[float, FloatArray | None]:
        """The largest m with sign (n_i - n_j) >= needed(t) + m for all pairs, and its filter; -inf where none is."""
        size = self.base.size
        # Columns: N, then m. Margin rows: -sign (n_i - n_j) + m <= -needed.
        rows = [np.hstack([self._rows.toarray(), np.zeros((self._rows.shape[0], 1))])]
        limits = [self._limits]
        for name in signs:
            inside = _INSIDE_DN if self._least(name) else 0.0
            needed = np.sqrt(np.maximum(0.0, self._needed(name, t) ** 2 - self.fixed_squared[name]))
            bound = needed > 0
            pairs = -signs[name] * self.difference[name][bound]
            rows.append(np.hstack([pairs, np.ones((len(pairs), 1))]))
            limits.append(-needed[bound] - inside)
        for name, (row, constant) in self._sums.items():
            if self._needed(name, t) > 0:
                rows.append(-np.append(row, 0.0)[None])
                limits.append(np.array([constant - self._needed(name, t)]))
        found = linprog(
            c=np.append(np.zeros(size), -1.0),
            A_ub=np.vstack(rows),
            b_ub=np.concatenate(limits),
            bounds=[*zip(self.low, self.base, strict=True), (None, _most_margin(t))],
            method="highs",
        )
        if found.status not in (0, 2):  # 2: proven infeasible
            raise SweepError(Fault(f"the limit's linear program ended without an answer: {found.message}"))
        return (float(found.x[-1]), found.x[:-1]) if found.status == 0 else (-np.inf, None)

    def beyond(self, t: float, margin: float, signs: Signs) -> float:
        """No filter reaches more than this, given the best margin at t; infinite where the margin does not say.

        What a pair with fixed part f needs, sqrt((t / weight)^2 - f), grows with t by 1 / weight or more. So a margin
        of 0 or more bounds what t can still gain; a negative one bounds nothing, since what is needed jumps where a
        pair begins to need something. The solver's margin is that of a filter that may be off by its tolerance at
        every wavelength.
        """
        weights = self.problem.objective.weights
        moving = all(name in weights and self._needed(name, t) > self._least(name) for name in signs)
        if not signs or not moving or not 0 <= margin < _most_margin(t) * (1 - _ROUNDING):
            return np.inf
        off = max(float(np.abs(self.difference[name]).sum(axis=1).max()) for name in signs) * _SOLVER_TOLERANCE
        return t + (margin + off + _MARGIN_DN) * max(weights[name] for name in signs)

    def reach(self, signs: Signs) -> float:
        """No filter comes further: each distance with a filter that is open where it helps, else closed."""
        ends = []
        for name, weight in self.problem.objective.weights.items():
            if name in signs:
                helps = signs[name] * self.difference[name]
                most = np.maximum(np.maximum(helps, 0) @ self.base + np.minimum(helps, 0) @ self.low, 0.0)
                ends.append(weight * float(np.sqrt(self.fixed_squared[name] + most**2).min()))
            else:
                row, constant = self._sums[name]
                ends.append(weight * float(row @ self.base + constant))
        return min(ends)

    def attained(self, curve: FloatArray) -> float:
        """The objective for a filter as the search evaluates it; -inf when it does not meet the constraints."""
        setup, problem = self.problem.setup, self.problem
        curves = curve[None, None]
        found = designed_quantities(setup, curves)
        for name in self.distances:
            found[name] = smooth_csd(setup, curves, problem.pairs[name])
        for name, bound in problem.constraints.items():
            if not bound.violation(found[name])[0] <= FEASIBLE:
                return -np.inf
        return float(problem.objective.of(found)[0])

    def inside(self, curve: FloatArray) -> FloatArray:
        """The solver's filter moved by its tolerance (1e-7) into the bounds, toward the base curve."""
        clipped = np.asarray(np.clip(curve, self.low, self.base), dtype=float)
        for share in (0.0, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5):
            moved = np.asarray(clipped + share * (self.base - clipped), dtype=float)
            if self.attained(moved) > -np.inf:
                return moved
        return clipped


def _most_margin(t: float) -> float:
    """Margins above this are not looked for: without a pair that binds, the program had no end."""
    return max(t, 1.0)


def _bracket(program: _Program, signs: Signs, known: float, tolerance: float) -> Limit:
    """The bracket for one choice of sides; `known` is attained elsewhere, below which nothing is looked for.

    Just above the lower end the margin shows how far the upper end can be; when that does not help, halfway.
    """
    low, high = max(known, 0.0), program.reach(signs) + tolerance
    attained, curve = -np.inf, None
    at = low
    for _ in range(_MOST_STEPS):
        before = high - low
        margin, found = program.best_margin(at, signs)
        if found is None or margin < -_MARGIN_DN:
            high = min(high, at)
        else:
            low = max(low, at)
            high = min(high, program.beyond(at, margin, signs))
        if found is not None:
            candidate = program.inside(found)
            reached = program.attained(candidate)
            if reached > attained:
                attained, curve = reached, candidate
            low = max(low, attained)
        if high - low <= tolerance:
            break
        at = low + tolerance / 2 if high - low < before / 2 else (low + high) / 2
    return Limit(attained, max(high, attained), curve)
