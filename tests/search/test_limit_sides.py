"""The limit where some signals of a type lie above and others below those of the other: an oracle of its own, a MILP."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sweep.metrics.bound import Bound
from sweep.metrics.objective import Objective
from sweep.search.filter_program import FilterProgram
from sweep.search.problem import Problem
from sweep.search.sides import _NEAR, Proof, SideRegion
from sweep.search.upper_bound import upper_bound_of
from sweep.study import load_study

from .limit_oracles import limit_checked_by_milp, milp_limit, random_problem, smallest, write_study


@pytest.fixture(scope="module")
def coarse(tmp_path_factory: pytest.TempPathFactory) -> Problem:
    """The problem on a grid of 10 nm."""
    study = load_study(write_study(tmp_path_factory.mktemp("coarse")))
    return study.problem(study.search)


@pytest.mark.parametrize("seed", range(6))
def test_the_limit_is_that_of_a_milp(coarse: Problem, seed: int) -> None:
    problem = random_problem(coarse, seed)
    limit = limit_checked_by_milp(problem)
    if seed % 2 == 0:  # the other channels tell nothing apart, so the MILP's margin is what is left to the limit
        assert milp_limit(problem, limit.proven) == pytest.approx(limit.proven, abs=1e-3)


def test_a_part_proves_no_more_than_its_own_cap(coarse: Problem) -> None:
    proof = Proof(1.0, None, 9.0, 0, (SideRegion(5.0), SideRegion(4.0)))
    assert proof.proven_at(FilterProgram(random_problem(coarse, 0)), 0.9) == 5.0


@pytest.mark.parametrize("seed", [0, 1, 3])
def test_a_proof_bounds_filters_of_other_sensitivities(coarse: Problem, seed: int) -> None:
    problem = random_problem(coarse, seed)
    own = problem.constraints["sensitivity"].min
    levels = [own + off for off in (-0.08, -0.02, 0.0, 0.01, 0.04)]
    limit = upper_bound_of(problem, sensitivities=levels)
    assert limit.elsewhere[2] == pytest.approx(limit.proven, abs=_NEAR + 1e-3)
    assert (np.diff(limit.elsewhere) <= _NEAR).all()  # each may be that much above the bound of its weights
    for level, most in zip(levels, limit.elsewhere, strict=True):
        there = replace(problem, constraints={**problem.constraints, "sensitivity": Bound(min=level)})
        assert milp_limit(there, most + 1e-3) < most + 1e-3  # by a MILP of its own, no filter exceeds it


@pytest.mark.parametrize("seed", [0, 1])
def test_several_csds_have_sides_of_their_own(coarse: Problem, seed: int) -> None:
    """The smallest of two weighted CSDs, and a third one that is constrained: each with pairs on either side."""
    problem = random_problem(coarse, seed)
    lights = problem.setup.lights
    types = tuple("orange" if i % 3 == 2 else kind for i, kind in enumerate(lights.types))
    problem = replace(
        problem,
        setup=replace(problem.setup, lights=replace(lights, types=types)),
        objective=Objective(minimum={"csd_yellow_red": 1.0, "csd_orange_red": 1.5}),
    )
    free = limit_checked_by_milp(problem)
    held = smallest(problem, free.curve, "csd_yellow_orange")
    bound = {**problem.constraints, "csd_yellow_orange": Bound(min=held + 1.0)}
    held_apart = replace(problem, constraints=bound)
    if milp_limit(held_apart, 0.0) == -np.inf:
        assert upper_bound_of(held_apart).proven == -np.inf
    else:
        assert limit_checked_by_milp(held_apart).proven <= free.proven


def test_an_interrupted_proof_returns_its_bound(coarse: Problem) -> None:
    problem = random_problem(coarse, 9)
    whole = limit_checked_by_milp(problem)
    ends = []
    for most in (3, 6, 10, whole.programs):
        found = upper_bound_of(problem, most_programs=most)
        assert found.programs <= most
        assert found.attained <= whole.proven
        assert found.proven >= whole.attained
        assert (found.open_parts > 0) == (found.proven > found.attained + 1e-3)
        ends.append(found.proven)
    assert ends == sorted(ends, reverse=True)
    assert ends[0] > whole.proven + 1
