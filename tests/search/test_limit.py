"""Upper bounds: a closed form for one pair, a certified bracket, no filter of any family beats it, relaxed constraints."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from sweep.base.errors import SweepError
from sweep.camera.pixel import Pixel
from sweep.camera.scene import FixedExposure, Scene
from sweep.designs.families.stopband import Stopband
from sweep.designs.tolerance import NONE, Tolerance
from sweep.metrics.bound import FEASIBLE, Bound
from sweep.metrics.objective import Objective
from sweep.search.gradients import Model
from sweep.search.problem import Problem, SearchRun, starting_points
from sweep.search.trade_off import check_proof
from sweep.search.upper_bound import _relaxed, reason_without_bound, upper_bound_of
from sweep.spectra.population import Population

from ..cases import thinned
from .limit_oracles import check_attained
from .problems import PROBLEM, STUDY, best_of, csd_of, noisy_problem, problem_of

LIMIT = upper_bound_of(PROBLEM)
SETUP = PROBLEM.setup
BASE = SETUP.camera.base_qe[0]


def constrained(**bounds: Bound) -> Problem:
    """The search of `stopband` with other or more constraints."""
    return replace(PROBLEM, constraints={**PROBLEM.constraints, **bounds})


def test_a_tighter_study_has_a_lower_limit() -> None:
    tight = upper_bound_of(constrained(min_transmission=Bound(min=0.3)))
    assert tight.proven < LIMIT.attained
    assert (tight.curve >= 0.3 * BASE * (1 - 1e-9)).all()
    assert upper_bound_of(constrained(slope_per_nm=Bound(max=0.04))).proven <= LIMIT.proven
    assert upper_bound_of(replace(PROBLEM, constraints={"sensitivity": Bound(min=1.01)})).curve is None


def test_no_upper_bound_is_claimed_where_the_program_is_not_linear() -> None:
    other = replace(PROBLEM, objective=Objective(sum={"csd_green_red": 1.0, "csd_yellow_red": 2.0}))
    assert reason_without_bound(other) == "the objective is a sum"
    with pytest.raises(SweepError, match="no upper bound: the objective is a sum"):
        upper_bound_of(other)
    assert reason_without_bound(problem_of("dual")) == "more than one modified channel"
    mixed = replace(PROBLEM, setup=SETUP.with_camera(pixel=Pixel(crosstalk=0.01)))
    assert reason_without_bound(mixed) == "crosstalk mixes the modified channel into others"


def test_least_loss_of_sensitivity_is_the_inverse_of_the_largest_separation() -> None:
    """The most sensitive filter with CSD >= c, and the largest CSD at that sensitivity, are the same filter."""
    slope = {"slope_per_nm": PROBLEM.constraints["slope_per_nm"]}
    most = replace(
        PROBLEM,
        objective=Objective(minimum={"sensitivity": 1.0}),
        constraints={**slope, "csd_yellow_red": Bound(min=200.0)},
    )
    found = upper_bound_of(most)
    assert 0 <= found.proven - found.attained <= 2e-6
    assert csd_of(SETUP, found.curve[None, None])[0] >= 200 * (1 - FEASIBLE)
    back = upper_bound_of(replace(PROBLEM, constraints={**slope, "sensitivity": Bound(min=found.attained)}))
    assert back.attained == pytest.approx(200, abs=0.05)
    assert 0.9 < best_of(most, 4, 125).objective <= found.proven


def test_upper_bound_leaves_out_constraints_of_edges() -> None:
    found = upper_bound_of(
        replace(constrained(edge_width_nm=Bound(min=20.0), worst_sensitivity=Bound(min=0.93)), tolerance=Tolerance(2.0))
    )
    assert found.left_out == ("edge_width_nm", "edge shifts of sensitivity")
    assert found.proven == pytest.approx(upper_bound_of(constrained(sensitivity=Bound(min=0.93))).proven, abs=1e-9)


def test_no_upper_bound_is_claimed_where_it_would_not_hold() -> None:
    wave, green = STUDY.grid.nodes_nm, STUDY.sensor.qe["G"]
    below = replace(PROBLEM, family=Stopband(wave, BASE, -0.1 * green))
    assert reason_without_bound(below) == "filters of the box may be below 0"
    bright = replace(SETUP, scene=Scene(exposure=FixedExposure(exposure_s=1000.0)))
    assert (
        reason_without_bound(replace(PROBLEM, setup=bright)) == "signals exceed the full well or the range of the ADC"
    )


@pytest.mark.parametrize("level", [0.8, 0.9, 1.0])
def test_few_linear_programs_close_the_bracket_and_its_filter_attains_it(level: float) -> None:
    """Halving the range of 700 DN down to 1e-3 DN alone takes twenty, for each choice of 256 sides."""
    problem = constrained(sensitivity=Bound(min=level))
    found = upper_bound_of(problem)
    check_attained(problem, found)
    assert found.programs <= 20
    assert found.open_parts == 0
    assert 0 <= found.proven - found.attained <= 1e-3


HALF = {"temperature_c": [-40, 85], "self_heating_k": 20, "binning_nm": 2, "wanted_yield": 0.5, "draws": 1000}


@cache
def half_yield_problem() -> Problem:
    """Half of the lamps have a distance; edges come out off."""
    setup = replace(SETUP, lights=replace(SETUP.lights, population=Population.model_validate(HALF)))
    return replace(PROBLEM, setup=setup, tolerance=Tolerance(2.0), constraints={"sensitivity": Bound(min=0.9)})


def noisy() -> Problem:
    """d' and errors under noise; edges come out off."""
    return replace(
        noisy_problem("stopband", 4.0, 0.9, Objective(minimum={"csd_yellow_red": 1.0})), tolerance=Tolerance(2.0)
    )


def values(problem: Problem, names: list[str]) -> list[dict[str, float]]:
    """Quantities of some designs as a search sees them."""
    some = {name: Bound.model_validate({problem.quantities[name].ends[0]: 1.0}) for name in names}
    model = Model(replace(problem, constraints=some), SearchRun(0), 1000)
    points = [model.at(u) for u in starting_points(problem, 3, 2)]
    return [{name: problem.quantities[name].value(rows) for name, rows in point.quantities.items()} for point in points]


@pytest.mark.parametrize("made", thinned([noisy, half_yield_problem]))
def test_filters_that_meet_the_study_meet_the_constraints_of_the_bound(made: Callable[[], Problem]) -> None:
    problem = made()
    requested = {name: quantity for name, quantity in problem.quantities.items() if quantity.ends and quantity.smooth}
    known = 0
    for design in values(problem, list(requested)):
        for name, quantity in requested.items():
            for end in quantity.ends:
                bound = Bound.model_construct(**({"min": None, "max": None} | {end: design[name]}))
                relaxed, left_out = _relaxed(replace(problem, constraints={name: bound}))
                assert (name in left_out) == (not relaxed.constraints)
                known += bool(relaxed.constraints)
                for kept, limits in relaxed.constraints.items():
                    assert limits.violation(np.array([design[kept]]))[0] <= FEASIBLE, (name, kept)
    assert known > 20


def test_yield_constraint_is_left_out_of_the_upper_bound() -> None:
    """It lies above what the nearest lights of the study have: to ask that of these would be more than the study does."""
    lights = replace(
        half_yield_problem().setup.lights, population=Population.model_validate({"wanted_yield": 0.5, "draws": 1000})
    )
    requested = {"sensitivity": Bound(min=0.9), "yield_csd_yellow_red": Bound(min=285)}
    problem = replace(
        half_yield_problem(),
        setup=replace(half_yield_problem().setup, lights=lights),
        tolerance=NONE,
        constraints=requested,
    )
    found = best_of(problem, 1, 60)
    limit = upper_bound_of(problem)
    check_proof(found, limit)
    assert limit.left_out == ("yield_csd_yellow_red",)


def test_the_bound_is_of_what_the_box_reaches_where_that_is_above_the_replaced_curve() -> None:
    wave, green = STUDY.grid.nodes_nm, STUDY.sensor.qe["G"]
    above = np.where((wave >= 500) & (wave <= 560), 1.05 * BASE, np.minimum(green, BASE))
    low, high = np.array([490.0, 6, 565, 6, 0]), np.array([500.0, 6, 575, 6, 1])
    goal = Objective(minimum={"sensitivity": 1.0})
    raised = replace(PROBLEM, family=Stopband(wave, BASE, above), low=low, high=high, objective=goal, constraints={})
    plain, found = (
        upper_bound_of(replace(raised, family=Stopband(wave, BASE, np.minimum(above, BASE)))),
        best_of(raised, 2, 60),
    )
    limit = upper_bound_of(raised)
    assert limit.of_box
    assert not plain.of_box
    assert plain.proven < found.objective <= limit.proven  # the old ceiling is not a bound on this box
    check_proof(found, limit)


def test_no_upper_bound_is_claimed_where_a_filter_comes_out_above_the_curve_that_it_replaces() -> None:
    """Its edges keep it from where its other curve is above that, but not when they come out elsewhere."""
    wave = STUDY.grid.nodes_nm
    target = np.where((wave >= 656) & (wave <= 658), 1.1 * BASE, np.minimum(STUDY.sensor.qe["G"], BASE))
    low, high = np.array([600.0, 6, 640, 6, 1]), np.array([610.0, 6, 650, 6, 1])
    objective = Objective(minimum={"worst_csd_yellow_red": 1.0})
    problem = replace(
        half_yield_problem(), family=Stopband(wave, BASE, target), low=low, high=high, objective=objective
    )
    assert (
        reason_without_bound(problem)
        == "filters of the box may exceed the curve that they replace, and the bound is of more than plain CSDs"
    )
    assert reason_without_bound(replace(problem, tolerance=NONE)) is None
    assert reason_without_bound(replace(problem, objective=Objective(minimum={"csd_yellow_red": 1.0}))) is None
