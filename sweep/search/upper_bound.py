"""Upper bound on any filter in one modified channel, not only on those of a family.

It holds for every N between the least transmission and the base curve (or the box, where that reaches above it) that
meets the study's constraints on slope, sensitivities and CSDs, whichever of two signals N makes the brighter one, for
the response before clipping and quantization in the scene of the search. For d' it is a bound with the least noise
(`least_noise.py`), which no filter need approach. The result is a bracket: a filter that attains the lower end, and
linear programs which prove that no filter is above the upper end. Worst cases of CSDs are over the population of the
lights, and over production where that moves the whole shape of a filter (`perturbed.py`). Constraints that only some
families have (widths of edges and bands) are left out, and so are other worst cases: with more filters the upper end
stays true.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..base.errors import SweepError, UpperBoundExceededError, ValidationIssue
from ..base.types import PerWavelength
from ..camera.exposure import exposed_at, largest_sensitivity_not_brightest, may_be_brightest
from ..camera.pixel import unquantized
from ..metrics.bound import FEASIBLE, Bound
from ..metrics.columns.sensitivity import SENSITIVITY
from ..metrics.evaluate import designed_quantities
from ..metrics.objective import Objective
from ..metrics.quantity import DN, WORST_CASE
from ..metrics.smooth import smooth_csd, smooth_response
from ..metrics.smooth_noise import smooth_detectability
from .certificate import ROUNDING
from .perturbed import all_ways, highest, perturbed_filters, reaches_above
from .problem import Problem

if TYPE_CHECKING:
    from .cuts import Pool
    from .filter_program import FilterProgram
    from .sides import Proof

_SENSITIVITY_TOLERANCE = 1e-6
_MOST_PROGRAMS = 5000
_ATTEMPTS, _ATTEMPT_PROGRAMS = 5, 100
"""How often bounds on worst cases are raised until a filter keeps them, with so many linear programs each."""
_LOOSE = 1e-3
"""Relative width at which a bound over an interval of sensitivities is close enough."""
_PROOF_TOLERANCE = 1e-9
"""A design may exceed a proven limit by this share, which is rounding, and no more."""
_NOT_LINEAR = "is not linear in the filter"
_SHARES = (0.0, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5)
"""How far a solver's filter is moved toward one that is inside, to make up for the solver's tolerance."""


@dataclass(frozen=True)
class UpperBound:
    """Upper bound, and a filter near it, in the objective's unit.

    `attained`: objective of `curve`, evaluated like any design; -inf if no feasible filter is known; `proven`: upper
    bound on any filter; -inf if no filter meets the constraints; `open_parts`: parts of the proof that were left open,
    so that the bracket is wider; 0 if none; `of_box`: of filters that may exceed the replaced curve where the box does.
    """

    attained: float
    proven: float
    curve: PerWavelength | None = field(repr=False)
    left_out: tuple[str, ...] = ()
    programs: int = 0
    open_parts: int = 0
    elsewhere: tuple[float, ...] = ()
    of_box: bool = False


def upper_bound_of(
    problem: Problem,
    tolerance_dn: float = 1e-3,
    most_programs: int = _MOST_PROGRAMS,
    sensitivities: Sequence[float] = (),
) -> UpperBound:
    """Compute the upper bound of a problem with one modified channel.

    `tolerance_dn`: width of the bracket, DN (1e-6 for an objective without a CSD); `most_programs`: linear programs,
    approximately at most; the bracket is wider if they are too few. Raises SweepError if the response is not linear;
    see `reason_without_bound`.
    """
    refused = reason_without_bound(problem)
    if refused is not None:
        raise SweepError(ValidationIssue(f"no upper bound: {refused}"))
    effort = tolerance_dn, most_programs, sensitivities
    brightest = may_be_brightest(problem.setup, _most_sensitive(problem, stated=False))
    found = (_limit_of_exposures if brightest else _limit_of)(problem, *effort)
    return replace(found, of_box=reaches_above(problem))


def _limit_of_exposures(
    problem: Problem, tolerance_dn: float, most_programs: int, sensitivities: Sequence[float]
) -> UpperBound:
    """Compute the upper bound where the modified channel may be the brightest one on white and set the exposure.

    Then the exposure falls with its sensitivity s, and distances with the exposure. So filters with s from a to b have
    no more than a linear program for these says at the exposure of a. Where that is loose the interval is halved.
    """
    stated, most = problem.constraints.get(SENSITIVITY), _most_sensitive(problem)
    least = 0.0 if stated is None or stated.min is None else stated.min
    dim, grid = largest_sensitivity_not_brightest(problem.setup), problem.setup.camera.grid
    relaxed = _relaxed(problem)[0]

    def part(a: float, b: float) -> _Part:
        within = replace(problem, constraints={**problem.constraints, SENSITIVITY: Bound.model_construct(min=a, max=b)})
        exposed = replace(within, setup=exposed_at(problem.setup, max(0.0, a - 2 * FEASIBLE)))
        limit = _limit_of(exposed, tolerance_dn, most_programs, [max(s, a) for s in sensitivities])
        share = (
            0.0
            if limit.curve is None
            else float(grid.integrate(limit.curve) / grid.integrate(problem.setup.camera.base_qe[0]))
        )
        if limit.curve is not None and share > max(a, dim):  # at its own exposure
            own = replace(relaxed, setup=exposed_at(problem.setup, share))
            limit = replace(limit, attained=_attained(own, limit.curve, _pool_of(own).least(limit.curve)))
        return _Part(a, b, limit)

    inner = sorted(s for s in sensitivities if max(least, dim) < s < most)
    asked = [max(least, dim), inner[len(inner) // 2]] if inner else []
    ends = sorted({least, most, *asked})
    parts = [part(a, b) for a, b in pairwise(ends)]
    while sum(p.upper_bound.programs for p in parts) < most_programs:
        highest, attained = max(parts, key=lambda p: p.upper_bound.proven), max(p.upper_bound.attained for p in parts)
        a, b = highest.least, highest.most
        loose = max(_LOOSE * highest.upper_bound.proven, tolerance_dn)
        if b <= max(dim, a * (1 + _LOOSE)) or highest.upper_bound.proven - attained <= loose:
            break
        parts.remove(highest)
        middle = dim if a < dim else (a + b) / 2
        parts += [part(a, middle), part(middle, b)]
    best, limits = max((p.upper_bound for p in parts), key=lambda limit: limit.attained), [p.upper_bound for p in parts]
    best = best if best.attained > -np.inf else replace(best, curve=None)
    elsewhere = [
        max((p.upper_bound.elsewhere[k] for p in parts if p.most >= s), default=-np.inf)
        for k, s in enumerate(sensitivities)
    ]
    return replace(
        best,
        proven=max(limit.proven for limit in limits),
        programs=sum(limit.programs for limit in limits),
        open_parts=sum(limit.open_parts for limit in limits),
        elsewhere=tuple(elsewhere),
    )


class _Part(NamedTuple):
    """Sensitivities of the modified channel, and the bound on filters with these."""

    least: float
    most: float
    upper_bound: UpperBound


def _limit_of(problem: Problem, tolerance_dn: float, most_programs: int, sensitivities: Sequence[float]) -> UpperBound:
    """Compute the upper bound where the exposure does not depend on the filter."""
    relaxed, left_out = _relaxed(problem)
    distances = any(relaxed.quantities[name].distance_kind for name in relaxed.objective.weights)
    tolerance = tolerance_dn if distances else _SENSITIVITY_TOLERANCE
    pool, solved = _pool_of(relaxed), 0
    while True:
        program, proof = _proof(relaxed, pool, tolerance, most_programs - solved)
        solved += program.solved
        if proof.curve is None or solved >= most_programs or not pool.more(proof.curve):
            break
    attained, curve = proof.attained, proof.curve
    if curve is not None and (pool.names or program.noisy):
        attained, curve, more = _attaining(relaxed, curve, pool, tolerance)
        solved += more
    least = relaxed.constraints.get(SENSITIVITY)
    from_here = -np.inf if not program.noisy or least is None or least.min is None else least.min
    elsewhere = tuple(proof.proven_at(program, s) if s >= from_here else np.inf for s in sensitivities)
    return UpperBound(attained, proof.proven, curve, left_out, solved, proof.open_parts, elsewhere)


def check_bound(value: float, proven: float, where: str = "") -> None:
    """Raise an error if a value before quantization exceeds its upper bound.

    Raises UpperBoundExceededError if the value exceeds the bound.
    """
    if not value <= proven + _PROOF_TOLERANCE * max(1.0, proven):
        raise UpperBoundExceededError(
            ValidationIssue(
                f"upper bound exceeded (bug){where}: a filter has {value:.9g}, but its bound is {proven:.9g}; finished "
                "results are kept"
            )
        )


def gap_between(value: float, proven: float) -> float:
    """Return the relative gap of a value to its upper bound.

    (proven - value) / proven. Raises UpperBoundExceededError if the value exceeds the bound.
    """
    check_bound(value, proven)
    return 1 - min(value, proven) / proven


def _pool_of(problem: Problem) -> Pool:
    from .cuts import Pool  # noqa: PLC0415  (slow to import: kept off the start-up path)

    return Pool(problem)


def _proof(problem: Problem, pool: Pool, tolerance: float, most_programs: int) -> tuple[FilterProgram, Proof]:
    """Return the linear programs of a problem, and the proof of the bound."""
    from .filter_program import FilterProgram  # noqa: PLC0415  (slow to import: kept off the start-up path)
    from .sides import SideSearch  # noqa: PLC0415  (slow to import: kept off the start-up path)

    program = FilterProgram(problem, pool)

    def value(curve: PerWavelength, inside: PerWavelength | None) -> tuple[float, PerWavelength]:
        attained, moved = _inside(program.problem, np.clip(curve, program.low, program.high), inside, pool)
        return (program.reaches(moved) if program.noisy and attained > -np.inf else attained), moved

    return program, SideSearch(program, value, tolerance, most_programs).run()


def _attaining(
    problem: Problem, curve: PerWavelength, pool: Pool, tolerance: float
) -> tuple[float, PerWavelength | None, int]:
    """Return the value of a program's filter in all worst cases, the filter, and the number of further programs.

    A program knows some members and positions, so that its filter may miss a bounded worst case. Then the bounds are
    raised by twice the violation until a filter meets those of the problem; None if none does.
    """
    requested, solved = problem, 0
    for _ in range(_ATTEMPTS):
        worst = pool.least(curve)
        attained = _attained(problem, curve, worst)
        if attained > -np.inf:
            return attained, curve, solved
        shortfall = {n: b.min - worst[n] for n, b in problem.constraints.items() if n in worst and b.min is not None}
        shortfall = {name: lack for name, lack in shortfall.items() if lack > 0}
        if not shortfall:
            break
        bounds = requested.constraints
        raised = {n: Bound.model_construct(min=(bounds[n].min or 0.0) + 2 * lack) for n, lack in shortfall.items()}
        requested = replace(requested, constraints={**bounds, **raised})
        program, solution = _proof(requested, pool, tolerance, _ATTEMPT_PROGRAMS)
        solved += program.solved
        if solution.curve is None:
            break
        curve = solution.curve
    return -np.inf, None, solved


def reason_without_bound(problem: Problem) -> str | None:
    """Return the reason why a problem has no linear upper bound.

    None if it has one.
    """
    unknown = [name for name in problem.objective.weights if not problem.quantities[name].has_limit]
    why = _NOT_LINEAR
    if any(problem.quantities[name].states for name in unknown):
        why = "is not convex in the filter: its noise grows with the light; d' has a limit"
    if problem.has_user_objective:
        why = "is an own metric, of which nothing is known"
    base, family = problem.setup.camera.base_qe[0], problem.family
    reasons: tuple[tuple[Callable[[], bool], str], ...] = (
        (lambda: family.n_modified != 1, "more than one modified channel"),
        (lambda: not problem.objective.rule.smallest, f"the objective is a {problem.objective.rule.name}"),
        (lambda: _merges(problem), "merged captures under noise, or as codes, are not linear in the filter"),
        (lambda: bool(unknown), f"{', '.join(unknown)} {why}"),
        (lambda: problem.setup.camera.pixel.crosstalk > 0, "crosstalk mixes the modified channel into others"),
        (
            lambda: bool((_top(problem) > base * (1 + ROUNDING)).any()) and not _plain(problem),
            "filters of the box may exceed the curve that they replace, and the bound is of more than plain CSDs",
        ),
        (
            lambda: bool((family.lower(problem.low, problem.high)[0] < -ROUNDING * base).any()),
            "filters of the box may be below 0",
        ),
        (
            lambda: _mixes_chromatic(problem),
            "of a chromatic separation none is known over all field positions or within limits of the brightness",
        ),
        (lambda: _clips(problem), "signals exceed the full well or the range of the ADC"),
        (
            lambda: may_be_brightest(problem.setup, _most_sensitive(problem)) and not _scales(problem),
            "the modified channel could set the exposure",
        ),
    )
    return next((reason for refused, reason in reasons if refused()), None)


def _merges(problem: Problem) -> bool:
    """Return whether readings are merged and not linear: noise shifts their mean where a capture hands over."""
    pixel, noisy = problem.setup.camera.pixel, problem.setup.scene.noise is not None
    return bool(pixel.captures) and (noisy or bool(pixel.companding))


def _mixes_chromatic(problem: Problem) -> bool:
    """Return whether a chromatic separation is asked for over all field positions, or in a limited brightness."""
    names, setup = (*problem.objective.weights, *problem.constraints), problem.setup
    chromatic = any(problem.quantities[name].distance_kind == "chromatic" for name in names)
    return chromatic and (setup.all_heights or setup.scene.brightness is not None)


def _scales(problem: Problem) -> bool:
    """Return whether distances are in proportion to an exposure that is known from the sensitivity of the filter."""
    names = {*problem.objective.weights, *problem.constraints}
    noisy = any(problem.quantities[name].distance_kind == "noise" for name in names)
    bound, dark = problem.constraints.get(SENSITIVITY), largest_sensitivity_not_brightest(problem.setup) == 0
    return not (noisy or _moves(problem) or (dark and (bound is None or not bound.min)))


def _most_sensitive(problem: Problem, *, stated: bool = True) -> float:
    """Return the largest sensitivity of the filters, and that the study allows if it has `stated` one."""
    camera, most = problem.setup.camera, 1.0
    if reaches_above(problem):
        most = float(camera.grid.integrate(highest(problem)) / camera.grid.integrate(camera.base_qe[0]))
    bound = problem.constraints.get(SENSITIVITY) if stated else None
    return most if bound is None or bound.max is None or _moves(problem) else min(most, bound.max)


def _plain(problem: Problem) -> bool:
    """Return whether all that is asked for is nominal, without noise, and at one brightness and one place."""
    asked = [problem.quantities[name] for name in (*problem.objective.weights, *problem.constraints)]
    nominal = all(one.distance_kind in ("", DN) and not one.extreme for one in asked)
    return nominal and not (problem.setup.all_phases or problem.setup.all_heights)


def _moves(problem: Problem) -> bool:
    """Return whether filters also count as production makes them."""
    requested = (*problem.constraints, *problem.objective.weights)
    return len(perturbed_filters(problem)) > 1 and any(problem.worst_distance(name) for name in requested)


def _relaxed(problem: Problem) -> tuple[Problem, tuple[str, ...]]:
    """Return the problem without constraints that only families of edges have, and their names.

    Worst cases of CSDs over a population or production stay; others become nominal ones, which are no worse.
    """
    quantities = problem.quantities
    requested = (*problem.constraints, *problem.objective.weights)
    moves = len(perturbed_filters(problem)) > 1
    stay = {name for name in requested if problem.worst_distance(name) and (problem.population or moves)}
    nominal = {name for name in requested if quantities[name].extreme == WORST_CASE} - stay
    plains = {name: quantities[name].of if name in nominal else name for name in requested}
    left_out: list[str] = []
    relaxed_bounds: dict[str, Bound] = {}
    for name, bound in problem.constraints.items():
        plain = plains[name]
        better = "min" if quantities[name].direction == "less" else "max"
        relaxed_bound = bound.model_copy(update={better: None}) if name in nominal else bound
        if not quantities[plain].has_limit or relaxed_bound.min is relaxed_bound.max is None:
            left_out.append(name)
            nominal -= {name} - problem.objective.weights.keys()
            continue
        left_out += [] if relaxed_bound == bound else [f"the {better} of {name}"]
        ends = [b for b in (relaxed_bound, relaxed_bounds.get(plain)) if b is not None]
        least, most = [b.min for b in ends if b.min is not None], [b.max for b in ends if b.max is not None]
        relaxed_bounds[plain] = Bound.model_construct(min=max(least, default=None), max=min(most, default=None))
    weights: dict[str, float] = {}
    for name, weight in problem.objective.weights.items():
        plain = plains[name]
        weights[plain] = min(weight, weights.get(plain, weight))
    if (stay or nominal) and problem.tolerance:
        left_out += _shifts_left_out([plains[name] for name in requested if name in nominal], problem)
    return replace(problem, objective=Objective(minimum=weights), constraints=relaxed_bounds), tuple(left_out)


def _shifts_left_out(nominal: Sequence[str], problem: Problem) -> list[str]:
    """Return a note on production errors that the bound leaves out."""
    if len(perturbed_filters(problem)) == 1:
        return ["edge shifts"]
    shifts = [] if all_ways(problem) else ["some edge shifts"]
    return [*shifts, *(f"edge shifts of {name}" for name in dict.fromkeys(nominal))]


def _top(problem: Problem) -> PerWavelength:
    """Return an upper bound on the filters of the box, in any worst case."""
    moved = perturbed_filters(problem)[1:] if _moves(problem) else ()
    tops = [problem.family.upper(problem.low, problem.high)[0], *(way.high for way in moved)]
    return np.asarray(np.max(tops, axis=0), dtype=float)


def _clips(problem: Problem) -> bool:
    """Return whether the response of the highest curve, the largest of all filters, is clipped."""
    setup = problem.setup
    smooth = smooth_response(setup, highest(problem)[None, None])
    top_dn = unquantized(np.array(setup.camera.pixel.saturation_e), setup.camera.pixel)
    return bool((smooth > top_dn).any())


def _inside(
    problem: Problem, curve: PerWavelength, inside: PerWavelength | None, pool: Pool
) -> tuple[float, PerWavelength]:
    """Return the value of a solver's filter, moved by its tolerance toward a feasible one, and the filter.

    Worst cases are over the known members, as the program counts them.
    """
    base = problem.setup.camera.base_qe[0]
    for end in (base,) if inside is None else (base, inside):
        for share in _SHARES:
            moved = np.asarray(curve + share * (end - curve), dtype=float)
            attained = _attained(problem, moved, pool.counted(moved))
            if attained > -np.inf:
                return attained, moved
    return -np.inf, curve


def _attained(problem: Problem, curve: PerWavelength, over: Mapping[str, float]) -> float:
    """Return the objective of a filter as the search evaluates it; -inf if it does not meet the constraints.

    `over` has the distances that are already known.
    """
    curves = curve[None, None]
    columns = designed_quantities(problem.setup, curves) | {name: np.array([value]) for name, value in over.items()}
    for name in {*problem.objective.weights, *problem.constraints} & problem.pairs.keys():
        if name not in over:
            quantity, pair = problem.quantities[name], problem.pairs[name]
            if quantity.distance_kind == DN:
                factors = quantity.factors(problem.setup.camera.mosaic)
                columns[name] = smooth_csd(problem.setup, curves, pair, factors)
            else:
                columns[name] = smooth_detectability(problem.setup, curves, pair)
    for name, bound in problem.constraints.items():
        if not bound.violation(columns[name])[0] <= FEASIBLE:
            return -np.inf
    return float(problem.objective.of(columns)[0])
