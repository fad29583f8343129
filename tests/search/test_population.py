"""Search and limit over a population of lights: derivatives, and filters that a program of its own would not allow."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from sweep.api.own_designs import columns_of, space_of_curves
from sweep.designs.tolerance import Tolerance
from sweep.metrics.bound import Bound
from sweep.metrics.members import population_model
from sweep.metrics.objective import Objective
from sweep.metrics.smooth import smooth_csd
from sweep.search.gradients import Model
from sweep.search.problem import Problem, SearchRun, starting_points
from sweep.search.upper_bound import upper_bound_of
from sweep.spectra.population import Population
from sweep.study import load_study

from ..conftest import STUDIES
from .problems import PROBLEM, YELLOW_RED, filters


@cache
def problem(**given: float) -> Problem:
    population = Population.model_validate({"temperature_c": [-40, 85], "self_heating_k": 20, **given})
    setup = replace(PROBLEM.setup, lights=replace(PROBLEM.setup.lights, population=population))
    return replace(PROBLEM, setup=setup, objective=Objective(minimum={"worst_csd_yellow_red": 1.0}))


def test_rows_over_the_population_have_their_derivative() -> None:
    shifted = replace(problem(binning_nm=1), tolerance=Tolerance(2.0, 0.003))
    model, checked = Model(shifted, SearchRun(0), 1000), 0
    for u in starting_points(shifted, 2, 3):
        here = model.at(u)
        assert np.sqrt(here.terms.values.min()) == pytest.approx(here.evaluation.objective, rel=1e-12)
        rows = np.argsort(here.terms.values)[:20]
        for free in range(u.size):
            step = np.zeros(u.size)
            step[free] = 1e-6
            if not 1e-6 <= u[free] <= 1 - 1e-6:
                continue
            ends = [model.at(u + sign * step).terms.values[rows] for sign in (1, -1)]
            np.testing.assert_allclose((ends[0] - ends[1]) / 2e-6, here.terms.by_u[rows, free], rtol=1e-3, atol=1e-2)
            checked += 1
    assert checked >= 6


@pytest.mark.slow
def test_no_random_filter_beats_the_limit_over_the_population() -> None:
    given = replace(problem(binning_nm=1), constraints={"sensitivity": Bound(min=0.9)})
    worst = population_model(given.setup).worst(filters(given, 3000)[:, None], [YELLOW_RED])
    proven = upper_bound_of(given).proven
    assert 0.3 * proven < worst["csd_yellow_red"].max() <= proven


def test_a_filter_of_ones_own_has_its_worst_case_where_no_edges_shift() -> None:
    study = load_study(STUDIES / "robust.yaml", changes={"production.edge_shift_nm": "0"})
    setup = study.setup(study.spaces[3], "f/2")
    curves = 0.9 * setup.camera.base_qe[None]
    space = study.spaces[3]
    assert space.filter is not None
    given = space_of_curves(space.cfa, space.filter.bases, curves, space.filter.technology)
    found = columns_of(study, given, "f/2")["worst_csd_yellow_red"]
    assert found == population_model(setup).worst(curves)["csd_yellow_red"]
    assert 0 < found[0] < smooth_csd(setup, curves, YELLOW_RED)[0]
