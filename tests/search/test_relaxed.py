"""What a limit asks of filters: no more than the study does, whatever quantity the study bounds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from sweep.curves.population import Population
from sweep.designs.families.stopband import Stopband
from sweep.metrics.bound import FEASIBLE, Bound
from sweep.metrics.objective import Objective
from sweep.search.gradients import Model
from sweep.search.limit import _relaxed, limit_of, why_not
from sweep.search.problem import Problem, SearchRun, best_feasible, starting_points
from sweep.search.solver import search_from
from sweep.search.trade_off import check_proof
from sweep.study import load_study

from ..cases import thinned
from ..conftest import STUDIES
from .noisy_problems import problem_of

STUDY = load_study(STUDIES / "stopband.yaml")
HALF = {"temperature_c": [-40, 85], "self_heating_k": 20, "binning_nm": 2, "wanted_yield": 0.5, "draws": 1000}


@cache
def share() -> Problem:
    """Half of the lamps have a distance; edges come out off."""
    assert STUDY.search is not None
    plain = STUDY.problem(STUDY.search)
    setup = replace(plain.setup, lights=replace(plain.setup.lights, population=Population.model_validate(HALF)))
    return replace(plain, setup=setup, edge_shift_nm=2.0, constraints={"sensitivity": Bound(min=0.9)})


def noisy() -> Problem:
    """d' and errors under noise; edges come out off."""
    return replace(problem_of("stopband", 4.0, 0.9, Objective(minimum={"csd_yellow_red": 1.0})), edge_shift_nm=2.0)


def values(problem: Problem, names: list[str]) -> list[dict[str, float]]:
    """Quantities of some designs as a search sees them."""
    some = {name: Bound.model_validate({problem.quantities[name].ends[0]: 1.0}) for name in names}
    model = Model(replace(problem, constraints=some), SearchRun(0), 1000)
    points = [model.at(u) for u in starting_points(problem, 3, 2)]
    return [{name: problem.quantities[name].value(rows) for name, rows in point.quantities.items()} for point in points]


@pytest.mark.parametrize("made", thinned([noisy, share]))
def test_what_meets_a_bound_of_the_study_meets_those_of_the_limit(made: Callable[[], Problem]) -> None:
    problem = made()
    asked = {name: quantity for name, quantity in problem.quantities.items() if quantity.ends and quantity.smooth}
    known = 0
    for design in values(problem, list(asked)):
        for name, quantity in asked.items():
            for end in quantity.ends:
                bound = Bound.model_construct(**({"min": None, "max": None} | {end: design[name]}))
                relaxed, left_out = _relaxed(replace(problem, constraints={name: bound}))
                assert (name in left_out) == (not relaxed.constraints)
                known += bool(relaxed.constraints)
                for kept, limits in relaxed.constraints.items():
                    assert limits.violation(np.array([design[kept]]))[0] <= FEASIBLE, (name, kept)
    assert known > 20


def test_a_bound_on_what_a_share_has_is_left_out_of_the_limit() -> None:
    """It lies above what the nearest lights of the study have: to ask that of these would be more than the study does."""
    lights = replace(share().setup.lights, population=Population.model_validate({"wanted_yield": 0.5, "draws": 1000}))
    asked = {"sensitivity": Bound(min=0.9), "yield_csd_yellow_red": Bound(min=285)}
    problem = replace(share(), setup=replace(share().setup, lights=lights), edge_shift_nm=0.0, constraints=asked)
    found = best_feasible(search_from(problem, 0, starting_points(problem, 1, 1)[0], "SLSQP", 60).log)
    assert found is not None
    limit = limit_of(problem)
    check_proof(found, limit)
    assert limit.left_out == ("yield_csd_yellow_red",)


def test_no_limit_is_claimed_where_a_filter_comes_out_above_the_curve_that_it_replaces() -> None:
    """Its edges keep it from where its other curve is above that, but not when they come out elsewhere."""
    wave, base, green = STUDY.grid.nodes_nm, share().setup.camera.base_qe[0], STUDY.sensor.qe["G"]
    target = np.where((wave >= 656) & (wave <= 658), 1.1 * base, np.minimum(green, base))
    low, high = np.array([600.0, 6, 640, 6, 1]), np.array([610.0, 6, 650, 6, 1])
    objective = Objective(minimum={"worst_csd_yellow_red": 1.0})
    problem = replace(share(), family=Stopband(wave, base, target), low=low, high=high, objective=objective)
    assert why_not(problem) == "filters of the box may exceed the curve that they replace"
    assert why_not(replace(problem, edge_shift_nm=0.0)) is None
    assert why_not(replace(problem, objective=Objective(minimum={"csd_yellow_red": 1.0}))) is None
