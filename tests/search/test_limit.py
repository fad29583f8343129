"""The limit: a closed form for one pair, a certified bracket, and no filter of any family that beats it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sweep.base.errors import SweepError
from sweep.camera.scene import FixedExposure, Scene
from sweep.camera.setup import Setup
from sweep.curves.lights import Lights
from sweep.designs.families.stopband import Stopband
from sweep.metrics.bound import FEASIBLE, Bound, total_violation
from sweep.metrics.evaluate import designed_quantities
from sweep.metrics.objective import Objective
from sweep.metrics.pareto import hypervolume
from sweep.metrics.separation import separation
from sweep.metrics.smooth import smooth_response
from sweep.report.summary import _limit_line
from sweep.results.facts import SearchFacts
from sweep.search.limit import limit_of, why_not
from sweep.search.problem import Problem, best_feasible, starting_points
from sweep.search.solver import search_from
from sweep.study import load_study

from ..cases import thinned
from ..conftest import STUDIES
from .stopband_filters import PROBLEM, STUDY, random_filters

LIMIT = limit_of(PROBLEM)


def csd(problem: Problem, curves: np.ndarray) -> np.ndarray:
    first, second = (problem.setup.members[name] for name in problem.pairs["csd_yellow_red"])
    return separation(smooth_response(problem.setup, curves)[:, 0], first, second)


def feasible(problem: Problem, curves: np.ndarray) -> np.ndarray:
    amounts = designed_quantities(problem.setup, curves)
    return total_violation(amounts, problem.constraints, np.zeros(len(curves))) <= FEASIBLE


def test_the_bracket_is_tight_and_attained_by_its_filter() -> None:
    assert LIMIT.curve is not None
    curve = LIMIT.curve
    assert 0 <= LIMIT.proven - LIMIT.attained <= 2e-3
    assert ((curve >= 0) & (curve <= PROBLEM.setup.camera.base_qe[0])).all()
    assert feasible(PROBLEM, curve[None, None])[0]
    assert csd(PROBLEM, curve[None, None])[0] == pytest.approx(LIMIT.attained, rel=1e-12)


def test_one_pair_of_signals_has_a_closed_form() -> None:
    """Without a slope bound, light is given up where it helps most per photon: the fractional knapsack's greedy rule."""
    lights = STUDY.lights
    keep = [lights.members["yellow"][3], lights.members["red"][5]]
    two = Lights("two", ("y", "r"), ("yellow", "red"), lights.photons[keep], lights.photon_ratio, "", True)
    problem = replace(PROBLEM, setup=replace(PROBLEM.setup, lights=two), constraints={"sensitivity": Bound(min=0.93)})
    found = limit_of(problem)
    base = problem.setup.camera.base_qe[0]
    response = smooth_response(problem.setup, base[None, None])[0, 0]
    channel = problem.setup.camera.modified[0]
    gain = response[:, channel] / (two.photons @ base)
    per_qe = gain[0] * two.photons[0] - gain[1] * two.photons[1]
    budget = 0.07 * base.sum()
    taken = np.zeros_like(base)
    for index in np.argsort(per_qe):
        if per_qe[index] >= 0 or budget <= 0:
            break
        taken[index] = min(base[index], budget)
        budget -= taken[index]
    fixed = np.delete(response, channel, axis=1)
    exact = np.hypot(np.linalg.norm(fixed[0] - fixed[1]), per_qe @ (base - taken))
    assert found.attained == pytest.approx(exact, abs=2e-3)
    assert found.proven >= exact - 1e-6


@pytest.mark.parametrize("kind", thinned(["free_form", "stopband", "multi_stopband"]))
def test_no_random_feasible_filter_beats_the_limit(kind: str) -> None:
    curves = random_filters(kind, 20_000, np.random.default_rng(11))
    # Scaled toward the base until the sensitivity holds, so that every filter takes part.
    base = PROBLEM.setup.camera.base_qe
    lost = 1 - designed_quantities(PROBLEM.setup, curves)["sensitivity"]
    share = np.minimum(1.0, 0.1 / np.maximum(lost, 1e-12))[:, None, None]
    curves = base + share * (curves - base)
    ok = feasible(PROBLEM, curves)
    assert ok.sum() > 3_334  # 10,000 over the three kinds
    assert csd(PROBLEM, curves[ok]).max() <= LIMIT.proven


@pytest.mark.slow
def test_free_form_search_comes_within_one_percent() -> None:
    study = load_study(STUDIES / "freeform.yaml")
    assert study.search is not None
    problem = study.problem(study.search)
    assert problem.constraints == PROBLEM.constraints
    log = [
        e for i, u in enumerate(starting_points(problem, 4, 1)) for e in search_from(problem, i, u, "SLSQP", 300).log
    ]
    best = best_feasible(log)
    assert best is not None
    assert 0.99 * LIMIT.proven <= best.objective <= LIMIT.proven


def test_a_tighter_study_has_a_lower_limit() -> None:
    tight = replace(PROBLEM, constraints={**PROBLEM.constraints, "min_transmission": Bound(min=0.3)})
    found = limit_of(tight)
    assert found.curve is not None
    assert found.proven < LIMIT.attained
    assert (found.curve >= 0.3 * PROBLEM.setup.camera.base_qe[0] * (1 - 1e-9)).all()
    steep = replace(PROBLEM, constraints={**PROBLEM.constraints, "slope_per_nm": Bound(max=0.04)})
    assert limit_of(steep).proven <= LIMIT.proven
    nothing = replace(PROBLEM, constraints={"sensitivity": Bound(min=1.01)})
    assert limit_of(nothing).curve is None


def test_no_limit_is_claimed_where_the_program_is_not_linear() -> None:
    other = replace(PROBLEM, objective=Objective(sum={"csd_green_red": 1.0, "csd_yellow_red": 2.0}))
    assert why_not(other) == "the objective is a sum"
    with pytest.raises(SweepError, match="no limit: the objective is a sum"):
        limit_of(other)
    dual = load_study(STUDIES / "dual.yaml")
    assert dual.search is not None
    assert why_not(dual.problem(dual.search)) == "more than one modified channel"


def test_least_loss_of_sensitivity_is_the_inverse_of_the_largest_separation() -> None:
    """The most sensitive filter with CSD >= c, and the largest CSD at that sensitivity, are the same filter."""
    slope = {"slope_per_nm": PROBLEM.constraints["slope_per_nm"]}
    most = replace(
        PROBLEM,
        objective=Objective(minimum={"sensitivity": 1.0}),
        constraints={**slope, "csd_yellow_red": Bound(min=200.0)},
    )
    found = limit_of(most)
    assert found.curve is not None
    assert 0 <= found.proven - found.attained <= 2e-6
    assert csd(PROBLEM, found.curve[None, None])[0] >= 200 * (1 - FEASIBLE)
    back = limit_of(replace(PROBLEM, constraints={**slope, "sensitivity": Bound(min=found.attained)}))
    assert back.attained == pytest.approx(200, abs=0.05)
    log = [e for i, u in enumerate(starting_points(most, 4, 1)) for e in search_from(most, i, u, "SLSQP", 125).log]
    best = best_feasible(log)
    assert best is not None
    assert 0.9 < best.objective <= found.proven


@pytest.mark.slow
def test_the_limit_of_the_smallest_of_several_distances() -> None:
    two = replace(PROBLEM, objective=Objective(minimum={"csd_yellow_red": 1.0, "csd_orange_red": 2.0}))
    found = limit_of(two)
    assert found.curve is not None
    members = PROBLEM.setup.members
    response = smooth_response(PROBLEM.setup, found.curve[None, None])[:, 0]
    yr, orange = (separation(response, members[kind], members["red"])[0] for kind in ("yellow", "orange"))
    assert min(yr, 2 * orange) == pytest.approx(found.attained, rel=1e-12)
    assert found.proven <= LIMIT.proven + 1e-3
    log = [e for i, u in enumerate(starting_points(two, 4, 1)) for e in search_from(two, i, u, "SLSQP", 125).log]
    best = best_feasible(log)
    assert best is not None
    assert best.objective <= found.proven
    # A constraint on another distance that binds lowers the limit; one that holds anyway changes nothing.
    held = {**PROBLEM.constraints, "csd_green_red": Bound(min=100.0)}
    assert limit_of(replace(PROBLEM, constraints=held)).proven == pytest.approx(LIMIT.proven, abs=2e-3)
    binding = {**PROBLEM.constraints, "csd_orange_red": Bound(min=float(orange) * 1.02)}
    assert limit_of(replace(PROBLEM, constraints=binding)).proven < LIMIT.proven


def test_the_limit_leaves_out_what_only_edges_have() -> None:
    extra = {"edge_width_nm": Bound(min=20.0), "worst_sensitivity": Bound(min=0.93)}
    asked = replace(PROBLEM, constraints={**PROBLEM.constraints, **extra}, edge_shift_nm=2.0)
    found = limit_of(asked)
    assert found.left_out == ("edge_width_nm", "edge shifts of sensitivity")
    nominal = limit_of(replace(PROBLEM, constraints={**PROBLEM.constraints, "sensitivity": Bound(min=0.93)}))
    assert found.proven == pytest.approx(nominal.proven, abs=1e-9)


def test_hypervolume_of_two_steps() -> None:
    values = np.array([[2.0, 1.0], [1.0, 2.0], [np.nan, 5.0], [-1.0, 9.0]])
    assert hypervolume(values, np.array([0.0, 0.0])) == pytest.approx(3.0)
    assert hypervolume(values[2:], np.array([0.0, 0.0])) == 0.0


def test_no_limit_is_claimed_where_it_would_not_hold() -> None:
    wave, cyan, green = STUDY.grid.nodes_nm, STUDY.sensor.qe["Cy"], STUDY.sensor.qe["G"]
    above = replace(PROBLEM, family=Stopband(wave, cyan, green), setup=_with_base(cyan))
    assert why_not(above) == "filters of the box may exceed the curve that they replace"
    below = replace(PROBLEM, family=Stopband(wave, PROBLEM.setup.camera.base_qe[0], -0.1 * green))
    assert why_not(below) == "filters of the box may be below 0"
    scenario = replace(PROBLEM.setup, scene=Scene(exposure=FixedExposure(exposure_s=1000.0)))
    assert why_not(replace(PROBLEM, setup=scenario)) == "signals exceed the full well or the range of the ADC"


def _with_base(curve: np.ndarray) -> Setup:
    qe = PROBLEM.setup.camera.qe.copy()
    qe[PROBLEM.setup.camera.modified[0]] = curve
    return PROBLEM.setup.with_camera(qe=qe)


def test_words_say_what_is_proven() -> None:
    """A finished proof, one that was cut short, and levels that were."""
    output: Any = SimpleNamespace(
        goal=PROBLEM.quantities["csd_yellow_red"], study=STUDY.section, scenarios=list(STUDY.scenarios)
    )
    done = SearchFacts(
        algorithm="SLSQP",
        scenario="chart",
        space="edges",
        cfa="RYNCy",
        channel="N",
        bounded=("search edges",),
        starts=1,
        evaluations=1,
        endings=("success",),
        objective="csd_yellow_red",
        best_smooth_objective=90.0,
        best_sensitivity=0.9,
        limit_attained=90.0,
        limit_proven=100.0,
        limit_left_out=("edge_width_nm",),
        limit_programs=9,
        limit_open_parts=0,
        front_limits_open=0,
        gap=0.1,
        no_limit=None,
        front_evaluations=0,
    )
    words = _limit_line(output, done)
    bracket = "for any filter in N of RYNCy: 100.0 DN (proven), and one filter comes within 10 DN of it"
    assert f"{bracket}; the search's answer is 10.0 % below it" in words
    assert "under the same constraints but edge_width_nm, before clipping and quantization" in words
    assert "open" not in words
    cut = _limit_line(output, done.model_copy(update={"limit_open_parts": 3}))
    assert "it may not be the least one: 3 parts are open after 9 linear programs" in cut
    unknown = _limit_line(output, done.model_copy(update={"limit_attained": None}))
    assert "N of RYNCy: 100.0 DN (proven); the search's answer is 10.0 % below it" in unknown
    levels = done.model_copy(update={"front_limits_open": 2})
    assert "At 2 levels of the front it may not be the least one" in _limit_line(output, levels)
    none = done.model_copy(update={"no_limit": "the objective is a sum", "limit_proven": None})
    assert _limit_line(output, none) == "Upper bound: none computed (the objective is a sum)."


@pytest.mark.parametrize("level", [0.8, 0.9, 0.97, 1.0])
def test_few_linear_programs_close_the_bracket(level: float) -> None:
    """Halving the range of 700 DN down to 1e-3 DN alone takes twenty, for each choice of 256 sides."""
    found = limit_of(replace(PROBLEM, constraints={**PROBLEM.constraints, "sensitivity": Bound(min=level)}))
    assert found.programs <= 20
    assert found.open_parts == 0
    assert 0 <= found.proven - found.attained <= 1e-3
