"""The physical limit: the best of all filters for one modified channel, not only those of a family.

Over all N(l) with 0 <= N <= base, a least transmission, a slope bound and the study's sensitivity, the largest t such
that every pair of a first and a second signal is at least t apart. For fixed t that is a linear program, so bisection
on t finds the global optimum. The certificate is a bracket: a filter that attains the lower end, and a linear program
that proves the upper end infeasible.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import csr_matrix, diags_array, vstack

from .arrays import FloatArray
from .constraints import FEASIBLE
from .errors import Fault, SweepError
from .evaluate import designed_quantities, smooth_response
from .metrics import separation
from .problem import Problem
from .scenes import WhitePatchExposure
from .sensor import electron_rate, unquantized

_MARGIN_DN = 1e-6
"""A linear program whose best margin is below minus this is infeasible beyond its solver's own tolerance."""
_MOST_STEPS = 80
_ROUNDING = 1e-9
_ALLOWED = ("sensitivity", "slope_per_nm", "min_transmission")


@dataclass(frozen=True)
class Limit:
    """The bracket of the limit, DN, and the filter that attains its lower end, QE, ndarray[n_wavelengths].

    `attained`: CSD of `curve`, evaluated like any design; no filter whose first signals all lie on one side of the
    second ones reaches `proven` or more. `curve` is None when no filter meets the constraints.
    """

    attained: float
    proven: float
    curve: FloatArray | None


def limit_of(problem: Problem, tolerance_dn: float = 1e-3) -> Limit:
    """The limit of a problem whose constraints are on `sensitivity`, `slope_per_nm` and `min_transmission`.

    Filters are bounded by 0 (or the least transmission) and the base curve. Raises SweepError where the program would
    not be linear: several modified channels, an exposure that the modified channel may set, or a constraint of another
    kind.
    """
    refused = why_not(problem)
    if refused is not None:
        raise SweepError(Fault(f"no limit: {refused}"))
    program = _Program(problem)
    above = _bisect(program, 1.0, -np.inf, tolerance_dn)
    below = _bisect(program, -1.0, above.attained, tolerance_dn)
    best = above if above.attained >= below.attained else below
    return Limit(best.attained, max(above.proven, below.proven), best.curve)


def why_not(problem: Problem) -> str | None:
    """Why a problem has no linear limit; None when it has."""
    others = [name for name in problem.constraints if name not in _ALLOWED]
    if problem.family.n_modified != 1:
        return "more than one modified channel"
    if (_top(problem) > problem.setup.base_qe[0] * (1 + _ROUNDING)).any():
        return "filters of the box may exceed the curve that they replace"
    if _clips(problem):
        return "signals exceed the full well or the range of the ADC"
    if others:
        return f"constraint on {others[0]}"
    if isinstance(problem.setup.scenario.exposure, WhitePatchExposure) and not _exposure_is_fixed(problem):
        return "the modified channel could set the exposure"
    return None


def _top(problem: Problem) -> FloatArray:
    """No filter of the box exceeds this curve, ndarray[n_wavelengths]."""
    return np.asarray(problem.family.upper(problem.low, problem.high)[0], dtype=float)


def _clips(problem: Problem) -> bool:
    """Whether the base curve's response, the largest that any of the filters has, is cut off when it is read out."""
    setup = problem.setup
    smooth = smooth_response(setup, setup.base_qe[None])
    well_dn = float(unquantized(np.array([setup.pixel.well_e]), setup.pixel)[0])
    return bool((smooth > min(float(setup.pixel.full_scale_dn), well_dn)).any())


def _exposure_is_fixed(problem: Problem) -> bool:
    """Whether a channel that is not modified is at least as bright on white as the base curve."""
    setup = problem.setup
    white = np.ones((1, setup.grid.size))
    rates = electron_rate(white, setup.qe, setup.grid.step_nm, setup.pixel)[0]
    kept = np.delete(rates, setup.modified)
    return bool(kept.size and kept.max() >= rates[list(setup.modified)].max())


class _Program:
    """The linear program: N between its bounds, slope, sensitivity; and what N gives for each signal."""

    def __init__(self, problem: Problem) -> None:
        setup = problem.setup
        self.problem = problem
        self.base = setup.base_qe[0]
        floor = problem.constraints.get("min_transmission")
        self.low = self.base * (0.0 if floor is None else floor.min or 0.0)
        size = setup.grid.size
        response = smooth_response(setup, self.base[None, None])[0]
        channel = setup.modified[0]
        # Exposure does not depend on N, so the response to a filter is linear, plus the pedestal.
        rate = electron_rate(setup.lights.photons, self.base[None], setup.grid.step_nm, setup.pixel)[:, 0]
        scale = (response[:, channel] - setup.pixel.offset_dn) / rate
        per_qe = setup.lights.photons * (setup.grid.step_nm * setup.pixel.area_m2)
        self.gain = per_qe * scale[:, None]
        first, second = (setup.members[name] for name in problem.pair)
        fixed = np.delete(response, channel, axis=1)
        apart = fixed[first, None] - fixed[None, second]
        self.fixed_squared = (apart**2).sum(axis=2).ravel()
        self.difference = (self.gain[first, None] - self.gain[None, second]).reshape(-1, size)
        rows, limits = [], []
        slope = problem.constraints.get("slope_per_nm")
        if slope is not None and slope.max is not None:
            step = diags_array([-1.0, 1.0], offsets=[0, 1], shape=(size - 1, size))
            rows += [step, -step]
            limits += [np.full(2 * (size - 1), slope.max * setup.grid.step_nm)]
        sensitivity = problem.constraints.get("sensitivity")
        total = csr_matrix(np.ones((1, size)) / self.base.sum())
        if sensitivity is not None and sensitivity.min is not None:
            rows.append(-total)
            limits.append(np.array([-sensitivity.min]))
        if sensitivity is not None and sensitivity.max is not None:
            rows.append(total)
            limits.append(np.array([sensitivity.max]))
        self.rows = vstack(rows).tocsr() if rows else csr_matrix((0, size))
        self.limits = np.concatenate(limits) if limits else np.empty(0)

    def best_margin(self, t: float, sign: float) -> tuple[float, FloatArray | None]:
        """The largest m with sign (n_i - n_j) >= needed(t) + m for all pairs, and its filter; -inf where none is."""
        needed = np.sqrt(np.maximum(0.0, t**2 - self.fixed_squared))
        bound = needed > 0
        size = self.base.size
        # Columns: N, then m. Margin rows: -sign (n_i - n_j) + m <= -needed.
        pairs = np.hstack([-sign * self.difference[bound], np.ones((int(bound.sum()), 1))])
        own = np.hstack([self.rows.toarray(), np.zeros((self.rows.shape[0], 1))])
        found = linprog(
            c=np.append(np.zeros(size), -1.0),
            A_ub=np.vstack([pairs, own]),
            b_ub=np.concatenate([-needed[bound], self.limits]),
            bounds=[*zip(self.low, self.base, strict=True), (None, max(t, 1.0))],
            method="highs",
        )
        if found.status not in (0, 2):  # 2: proven infeasible
            raise SweepError(Fault(f"the limit's linear program ended without an answer: {found.message}"))
        return (float(found.x[-1]), found.x[:-1]) if found.status == 0 else (-np.inf, None)

    def attained(self, curve: FloatArray) -> float:
        """CSD of a filter as the search evaluates it, DN; -inf when it does not meet the constraints."""
        setup = self.problem.setup
        curves = curve[None, None]
        amounts = designed_quantities(setup, curves)
        for name, bound in self.problem.constraints.items():
            if not bound.violation(amounts[name])[0] <= FEASIBLE:
                return -np.inf
        first, second = (setup.members[name] for name in self.problem.pair)
        return float(separation(smooth_response(setup, curves), first, second)[0])

    def inside(self, curve: FloatArray) -> FloatArray:
        """The solver's filter moved by its tolerance (1e-7) into the bounds, toward the base curve."""
        clipped = np.asarray(np.clip(curve, self.low, self.base), dtype=float)
        for share in (0.0, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5):
            moved = np.asarray(clipped + share * (self.base - clipped), dtype=float)
            if self.attained(moved) > -np.inf:
                return moved
        return clipped


def _bisect(program: _Program, sign: float, known: float, tolerance_dn: float) -> Limit:
    """The bracket for one sign; `known` is a CSD that is attained elsewhere, below which nothing is looked for."""
    # No pair can come further apart than the filter that is open where it helps and closed where it hurts.
    helps = sign * program.difference
    reach = np.maximum(helps, 0) @ program.base + np.minimum(helps, 0) @ program.low
    reach = np.maximum(reach, 0.0)
    low, high = max(known, 0.0), float(np.sqrt(program.fixed_squared + reach**2).min()) + tolerance_dn
    attained, curve = -np.inf, None
    at = low
    for _ in range(_MOST_STEPS):
        margin, found = program.best_margin(at, sign)
        if found is None or margin < -_MARGIN_DN:
            high = min(high, at)
        else:
            low = max(low, at)
        if found is None:
            break
        candidate = program.inside(found)
        reached = program.attained(candidate)
        if reached > attained:
            attained, curve = reached, candidate
        low = max(low, attained)
        if high - low <= tolerance_dn:
            break
        at = (low + high) / 2
    return Limit(attained, high, curve)
