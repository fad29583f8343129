"""Constrained search for the best design; the only module that uses nlopt.

The smallest distance of a pair of signal types is not smooth, so it is written in epigraph form: maximize t subject to
(distance of every pair)^2 >= t^2, with exact gradients; errors are minimized by a bound t on their decades below 1.
The search uses the smooth response (unquantized, unclipped). Every evaluation is logged, and the answer is the best
feasible one of the log.
"""

from __future__ import annotations

import contextlib
from dataclasses import replace

import nlopt
import numpy as np

from ..base.types import Array, Float, PerFree, PerParameter, PerTerm
from ..metrics.bound import FEASIBLE
from .gradients import Model, Point
from .problem import Evaluation, Problem, SearchRun

GRADIENT = {"SLSQP": nlopt.LD_SLSQP, "MMA": nlopt.LD_MMA, "CCSAQ": nlopt.LD_CCSAQ}
"""Gradient algorithms of nlopt that take inequality constraints, for the epigraph form."""
DIRECT = {
    "COBYLA": nlopt.LN_COBYLA,
    "ORIG_DIRECT_L": nlopt.GN_ORIG_DIRECT_L,
    "ISRES": nlopt.GN_ISRES,
    "AGS": nlopt.GN_AGS,
}
"""Derivative-free algorithms that take inequality constraints, for the objective itself."""
ALGORITHMS = (*GRADIENT, *DIRECT)
"""Every algorithm that a study can name."""
ONE_START = ("ORIG_DIRECT_L", "AGS")
"""Deterministic global algorithms: their search is the same from every starting point."""
_REFINEMENT = "SLSQP"
_ENDINGS = {
    nlopt.SUCCESS: "success",
    nlopt.FTOL_REACHED: "ftol_reached",
    nlopt.XTOL_REACHED: "xtol_reached",
    nlopt.MAXEVAL_REACHED: "maxeval_reached",
}
_X_TOLERANCE = 1e-9
_FAR = 1e4
"""So many times its value at the start a term under noise may reach; a number that no design comes near."""
_LEAST_SCALE = 1e-6
"""Absolute tolerance of quantities that may be negative."""
_UNKNOWN = 1e9
"""Range of quantities that may be negative, in multiples of the value at the start."""


def search_from(
    problem: Problem, start: int, u0: PerFree, algorithm: str, max_evaluations: int, seed: int = 1
) -> SearchRun:
    """Search from one starting point.

    `max_evaluations`: simulations at most. Returns log, with nlopt's status, or `settled` if a gradient search stayed
    at one point.
    """
    run = SearchRun(start)
    model = Model(problem, run, max_evaluations)
    first = model.at(u0)
    nlopt.srand(seed * 100_003 + start)
    if algorithm in GRADIENT:
        opt, z0 = _epigraph(problem, model, first, u0, algorithm)
    else:
        opt, z0 = _direct(problem, model, first, u0, algorithm)
    model.stop = opt.force_stop
    opt.set_maxeval(10 * max_evaluations)  # simulations are counted by the model, which forces the stop
    opt.set_xtol_rel(_X_TOLERANCE)
    opt.set_xtol_abs(_X_TOLERANCE)
    try:
        opt.optimize(z0)
        run.status = _ENDINGS.get(opt.last_optimize_result(), "unknown")
    except nlopt.RoundoffLimited:
        run.status = "roundoff_limited"
    except nlopt.ForcedStop:
        run.status = "maxeval_reached" if model.spent else "roundoff_limited" if model.lost else "settled"
    except (RuntimeError, nlopt.runtime_error):  # its own class; what it carries cannot leave this process
        run.status = "failed"
    return run


def refinement_of(problem: Problem, algorithm: str) -> str | None:
    """Return the gradient algorithm that continues from the best point of a derivative-free search.

    None for a search by gradients, and where a quantity has no derivatives.
    """
    names = (*problem.objective.weights, *problem.constraints)
    refined = algorithm in DIRECT and all(problem.quantities[name].slopes for name in names)
    return _REFINEMENT if refined else None


def smooth_evaluation(problem: Problem, x: PerParameter) -> Evaluation:
    """Return one design's objective, sensitivities and violation before clipping and quantization."""
    return Model(problem, SearchRun(0), 1).at(problem.to_unit(x)).evaluation


def smooth_objective(problem: Problem, x: PerParameter) -> float:
    """Return the objective of one design before clipping and quantization."""
    return smooth_evaluation(problem, x).objective


def _epigraph(
    problem: Problem, model: Model, first: Point, u0: PerFree, algorithm: str
) -> tuple[nlopt.opt, list[float]]:
    """Set up: maximize the rule of the t_k subject to rows of term k >= t_k^2 and the conditions.

    z = (u, t); each t_k is in units of its term's first value. Rows that are no squares are >= t_k.
    """
    values, rule, power = first.term_values, problem.objective.rule, first.power
    scale = np.maximum(np.abs(values), _LEAST_SCALE if problem.signed_goal else 1.0)
    n_free, n_rows = u0.size, first.terms.values.size
    alone = scale.size == 1
    unit = 1.0 if alone else float(rule.of(scale))
    row_scale = scale[first.term] ** power
    opt = nlopt.opt(GRADIENT[algorithm], n_free + scale.size)

    def objective(z: Float[Array, " variables"], gradient: Float[Array, " ..."]) -> float:
        model.at(z[:n_free])
        if model.settled:
            opt.force_stop()
        if gradient.size:
            gradient[:n_free] = 0.0
            gradient[n_free:] = 1.0 if alone else rule.gradient(scale * z[n_free:]) * scale / unit
        return float(z[-1]) if alone else float(rule.of(scale * z[n_free:])) / unit

    def constraints(
        result: Float[Array, " conditions"], z: Float[Array, " variables"], gradient: Float[Array, " ..."]
    ) -> None:
        point = model.at(z[:n_free])
        t = z[n_free:][point.term]
        result[:n_rows] = t**power - point.terms.values / row_scale
        result[n_rows:] = point.conditions.values
        if gradient.size:
            gradient[:] = 0.0
            gradient[:n_rows, :n_free] = -point.terms.by_u / row_scale[:, None]
            gradient[np.arange(n_rows), n_free + point.term] = power * t ** (power - 1)
            gradient[n_rows:, :n_free] = point.conditions.by_u

    # No term exceeds its largest weight times the longest distance between two digital numbers; noise has no such end.
    noisy = any(problem.quantities[name].states for name in problem.objective.weights)
    far = _FAR * scale if noisy else max(problem.objective.weights.values()) * problem.setup.camera.longest_distance_dn
    least, most = [0.0 if power == 2 else -_FAR] * scale.size, [max(float(r), 1.0) for r in far / scale]
    if problem.signed_goal:  # nothing is known of it
        least, most = [-_UNKNOWN] * scale.size, [_UNKNOWN] * scale.size
    opt.set_lower_bounds([0.0] * n_free + least)
    opt.set_upper_bounds([1.0] * n_free + most)
    opt.set_max_objective(objective)
    opt.add_inequality_mconstraint(constraints, np.zeros(n_rows + first.conditions.values.size))
    return opt, [*u0, *np.minimum(values / scale, 1.0)]


def _direct(problem: Problem, model: Model, first: Point, u0: PerFree, algorithm: str) -> tuple[nlopt.opt, list[float]]:
    """Set up: maximize the objective itself, subject to the worst of the conditions."""
    rule = problem.objective.rule

    def objective_of(terms: PerTerm) -> float:
        return float(terms.min() if rule.smallest else rule.of(terms))

    scale = objective_of(np.maximum(first.term_values, 1.0))

    def objective(u: PerFree, _: Float[Array, " ..."]) -> float:
        return objective_of(model.at(u).term_values) / scale

    opt = nlopt.opt(DIRECT[algorithm], u0.size)
    opt.set_lower_bounds([0.0] * u0.size)
    opt.set_upper_bounds([1.0] * u0.size)
    opt.set_max_objective(objective)
    opt.add_inequality_constraint(lambda u, _: float(model.at(u).conditions.values.max(initial=-1.0)), 0.0)
    return opt, [*u0]


def extreme_value(problem: Problem, quantity: str, starts: Float[Array, "starts free"], max_evaluations: int) -> float:
    """Return the extreme of a quantity in the box without other constraints.

    `max_evaluations`: simulations of each start at most. Returns largest value if the study asks for a minimum, else
    the smallest one.
    """
    alone = replace(problem, constraints={quantity: problem.constraints[quantity]})
    definition = problem.quantities[quantity]
    sign = 1.0 if problem.constraints[quantity].min is not None or definition.scale == "log10" else -1.0
    values = [v for u0 in starts for v in _extremes(alone, quantity, sign, u0, max_evaluations)]
    best = sign * max((sign * value for value in values), default=-np.inf)
    return definition.of_row(best) if np.isfinite(best) else best


def _extremes(problem: Problem, quantity: str, sign: float, u0: PerFree, max_evaluations: int) -> list[float]:
    """Return the worst rows of a quantity on the way to its extreme: maximize t, sign times rows >= t."""
    n_own = problem.family.violation(problem.low[None]).shape[1]
    model = Model(problem, SearchRun(0), max_evaluations)
    first = model.at(u0).quantities[quantity]
    scale = max(float(np.abs(first.values).max()), 1e-6)
    n_rows = first.values.size
    values: list[float] = []

    def objective(z: Float[Array, " variables"], gradient: Float[Array, " ..."]) -> float:
        point = model.at(z[:-1])
        if point.evaluation.violation < np.inf and (point.conditions.values[:n_own] <= FEASIBLE).all():
            values.append(sign * float((sign * point.quantities[quantity].values).min()))
        if gradient.size:
            gradient[:] = 0.0
            gradient[-1] = 1.0
        return float(z[-1])

    def conditions(
        result: Float[Array, " conditions"], z: Float[Array, " variables"], gradient: Float[Array, " ..."]
    ) -> None:
        point = model.at(z[:-1])
        rows = point.quantities[quantity]
        result[:n_rows] = z[-1] - sign * rows.values / scale
        result[n_rows:] = point.conditions.values[:n_own]
        if gradient.size:
            gradient[:n_rows, :-1] = -sign * rows.by_u / scale
            gradient[:n_rows, -1] = 1.0
            gradient[n_rows:, :-1] = point.conditions.by_u[:n_own]
            gradient[n_rows:, -1] = 0.0

    opt = nlopt.opt(nlopt.LD_SLSQP, u0.size + 1)
    opt.set_lower_bounds([0.0] * u0.size + [-1e6])
    opt.set_upper_bounds([1.0] * u0.size + [1e6])
    opt.set_max_objective(objective)
    opt.add_inequality_mconstraint(conditions, np.zeros(n_rows + n_own))
    model.stop = opt.force_stop
    opt.set_maxeval(max_evaluations)
    opt.set_xtol_rel(_X_TOLERANCE)
    with contextlib.suppress(nlopt.RoundoffLimited, nlopt.ForcedStop, nlopt.runtime_error, RuntimeError):
        opt.optimize([*u0, float((sign * first.values).min()) / scale])
    return values
