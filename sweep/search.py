"""Constrained search for the best design; the only file that knows nlopt.

Maximize the smallest distance of a pair of signal types. The minimum over pairs is not smooth, so it is written in the
epigraph form: maximize t subject to (distance of every pair)^2 >= t^2, with exact gradients. The search sees the smooth
response (unquantized, unclipped); every evaluation is logged, and the answer is the best feasible one of the log.
"""

from __future__ import annotations

import contextlib
from dataclasses import replace

import nlopt
import numpy as np

from .arrays import FloatArray
from .constraints import FEASIBLE
from .problem import Model, Point, Problem, SearchRun, best_feasible

GRADIENT = {"SLSQP": nlopt.LD_SLSQP, "MMA": nlopt.LD_MMA, "CCSAQ": nlopt.LD_CCSAQ}
"""Gradient algorithms of nlopt that take inequality constraints, for the epigraph form."""
DIRECT = {
    "COBYLA": nlopt.LN_COBYLA,
    "ORIG_DIRECT_L": nlopt.GN_ORIG_DIRECT_L,
    "ISRES": nlopt.GN_ISRES,
    "AGS": nlopt.GN_AGS,
}
"""Derivative-free algorithms that take inequality constraints, for the smallest distance itself."""
ALGORITHMS = (*GRADIENT, *DIRECT)
"""Every algorithm that a study can name."""
_ENDINGS = {
    nlopt.SUCCESS: "success",
    nlopt.FTOL_REACHED: "ftol_reached",
    nlopt.XTOL_REACHED: "xtol_reached",
    nlopt.MAXEVAL_REACHED: "maxeval_reached",
}
_X_TOLERANCE = 1e-9


def search_from(
    problem: Problem, start: int, u0: FloatArray, algorithm: str, max_evaluations: int, seed: int = 1
) -> SearchRun:
    """Search from one starting point with at most `max_evaluations` simulations.

    `u0`: ndarray[n_free], in units of the box. The status is nlopt's word for how it ended; an early end is no
    error, since the log keeps every evaluation. `seed` and `start` set the random numbers of the algorithms that use
    them (ISRES).
    """
    run = SearchRun(start)
    model = Model(problem, run, max_evaluations)
    first = model.at(u0)
    nlopt.srand(seed * 100_003 + start)
    if algorithm in GRADIENT:
        opt, z0 = _epigraph(problem, model, first, u0, algorithm)
    else:
        opt, z0 = _direct(model, first, u0, algorithm)
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
        run.status = "maxeval_reached"
    except (RuntimeError, nlopt.runtime_error):  # its own class; what it carries cannot leave this process
        run.status = "failed"
    return run


def _epigraph(
    problem: Problem, model: Model, first: Point, u0: FloatArray, algorithm: str
) -> tuple[nlopt.opt, list[float]]:
    """Maximize t subject to (distance of every pair)^2 >= t^2 and the conditions, with gradients; z = (u, t)."""
    scale = max(first.evaluation.csd, 1.0)
    opt = nlopt.opt(GRADIENT[algorithm], u0.size + 1)

    def objective(z: FloatArray, gradient: FloatArray) -> float:
        model.at(z[:-1])
        if gradient.size:
            gradient[:] = 0.0
            gradient[-1] = 1.0
        return float(z[-1])

    def constraints(result: FloatArray, z: FloatArray, gradient: FloatArray) -> None:
        point = model.at(z[:-1])
        n_pairs = point.squared.size
        result[:n_pairs] = z[-1] ** 2 - point.squared / scale**2
        result[n_pairs:] = point.conditions
        if gradient.size:
            gradient[:n_pairs, :-1] = -point.squared_by_u / scale**2
            gradient[:n_pairs, -1] = 2 * z[-1]
            gradient[n_pairs:, :-1] = point.conditions_by_u
            gradient[n_pairs:, -1] = 0.0

    limit = 2 * problem.setup.pixel.full_scale_dn * np.sqrt(len(problem.setup.mosaic.channels)) / scale
    opt.set_lower_bounds([0.0] * (u0.size + 1))
    opt.set_upper_bounds([1.0] * u0.size + [max(limit, 1.0)])
    opt.set_max_objective(objective)
    opt.add_inequality_mconstraint(constraints, np.zeros(first.squared.size + first.conditions.size))
    return opt, [*u0, min(first.evaluation.csd / scale, 1.0)]


def _direct(model: Model, first: Point, u0: FloatArray, algorithm: str) -> tuple[nlopt.opt, list[float]]:
    """Maximize the smallest distance itself, subject to the worst of the conditions."""
    scale = max(first.evaluation.csd, 1.0)
    opt = nlopt.opt(DIRECT[algorithm], u0.size)
    opt.set_lower_bounds([0.0] * u0.size)
    opt.set_upper_bounds([1.0] * u0.size)
    opt.set_max_objective(lambda u, _: float(np.sqrt(model.at(u).squared.min()) / scale))
    opt.add_inequality_constraint(lambda u, _: float(model.at(u).conditions.max(initial=-1.0)), 0.0)
    return opt, [*u0]


def best_reachable(problem: Problem, quantity: str, starts: FloatArray, max_evaluations: int) -> float:
    """The extreme that `quantity` reaches in the box when no other constraint counts: its largest value if the study
    asks for a minimum, else its smallest. `starts`: ndarray[n, n_free].
    """
    bound = problem.constraints[quantity]
    sign = 1.0 if bound.min is not None else -1.0
    if quantity in problem.pairs:
        alone = replace(problem, pair=problem.pairs[quantity], constraints={})
        log = [e for i, u in enumerate(starts) for e in search_from(alone, i, u, "SLSQP", max_evaluations).log]
        best = best_feasible(log)
        return -np.inf if best is None else best.csd
    alone = replace(problem, constraints={})
    found = []
    for index, u0 in enumerate(starts):
        model = Model(alone, SearchRun(index), max_evaluations)
        if quantity in model.at(u0).amounts_by_u:
            found += _climb(model, quantity, sign, u0, max_evaluations)
        else:
            found.append(model.at(u0).amounts[quantity])
    return sign * max((sign * value for value in found), default=-np.inf)


def _climb(model: Model, quantity: str, sign: float, u0: FloatArray, max_evaluations: int) -> list[float]:
    """Values of a sensitivity at well-formed designs on the way to its extreme."""
    seen: list[float] = []

    def objective(u: FloatArray, gradient: FloatArray) -> float:
        point = model.at(u)
        if (point.conditions <= FEASIBLE).all():
            seen.append(point.amounts[quantity])
        if gradient.size:
            gradient[:] = sign * point.amounts_by_u[quantity]
        return sign * point.amounts[quantity]

    def conditions(result: FloatArray, u: FloatArray, gradient: FloatArray) -> None:
        point = model.at(u)
        result[:] = point.conditions
        if gradient.size:
            gradient[:] = point.conditions_by_u

    opt = nlopt.opt(nlopt.LD_SLSQP, u0.size)
    opt.set_lower_bounds([0.0] * u0.size)
    opt.set_upper_bounds([1.0] * u0.size)
    opt.set_max_objective(objective)
    opt.add_inequality_mconstraint(conditions, np.zeros(model.at(u0).conditions.size))
    opt.set_maxeval(max_evaluations)
    opt.set_xtol_rel(_X_TOLERANCE)
    with contextlib.suppress(nlopt.RoundoffLimited, nlopt.runtime_error, RuntimeError):
        opt.optimize(u0)
    return seen
