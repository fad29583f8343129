"""Search and limit over a population of lights: derivatives, and filters that a program of its own would not allow."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from sweep.api.own_designs import columns_of, space_of_curves
from sweep.designs.tolerance import ProductionError, Tolerance
from sweep.metrics.members import population_model
from sweep.metrics.objective import Objective
from sweep.metrics.smooth import smooth_csd
from sweep.search.gradients import Model
from sweep.search.problem import Problem, SearchRun, starting_points
from sweep.search.upper_bound import UpperBound, reason_without_bound, upper_bound_of
from sweep.spectra.population import Population
from sweep.study import load_study

from ..conftest import STUDIES
from .problems import PROBLEM, YELLOW_RED, feasible_filters


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


def test_a_point_that_is_no_number_has_as_many_rows_and_is_never_feasible() -> None:
    """Solvers step there, and go on."""
    model = Model(problem(), SearchRun(0), 1000)
    usual, odd = (model.at(u).terms for u in (starting_points(problem(), 1, 3)[0], np.full(4, np.nan)))
    assert odd.values.shape == usual.values.shape
    assert np.isfinite(odd.values).all()
    assert model.at(np.full(4, np.nan)).evaluation.violation == np.inf


@cache
def limit() -> UpperBound:
    assert reason_without_bound(problem(binning_nm=1)) is None
    return upper_bound_of(problem(binning_nm=1))


@pytest.mark.slow
def test_no_random_filter_beats_the_limit_over_the_population() -> None:
    setup, rng, best = problem(binning_nm=1).setup, np.random.default_rng(3), 0.0
    for kind in ("stopband", "free_form"):
        worst = population_model(setup).worst(feasible_filters(setup, kind, 3000, rng), [YELLOW_RED])
        best = max(best, float(worst["csd_yellow_red"].max()))
    assert 0.3 * limit().proven < best <= limit().proven


@pytest.mark.slow
def test_the_table_of_the_documentation() -> None:
    """Each figure in `studies/guide/06-lamps-angles-tolerances.md`, but those of the answer and the limit: nominal, over temperature, over all."""
    text = (STUDIES / "guide" / "06-lamps-angles-tolerances.md").read_text(encoding="utf-8")
    lines = text.split("| worst case: temperature, bins, edges |")[1].splitlines()[2:6]
    printed = {cells[0]: cells[1:] for cells in ([c.strip() for c in line.strip("|").split("|")] for line in lines)}
    study = load_study(STUDIES / "robust.yaml")
    alone = load_study(STUDIES / "robust.yaml", changes={"population.binning_nm": "0"})
    found = {}
    for at, space in enumerate(study.spaces[:4]):
        shifts = (0.0,) if space.filter is None else (-2.0, -1.0, 0.0, 1.0, 2.0)
        point, setup = space.points(0, 1), study.setup(space, "f/2")
        curves = [space.curves(point, study.grid.size, ProductionError(shift)) for shift in shifts]
        over = population_model(setup).worst(np.concatenate(curves))["csd_yellow_red"].min()
        warm = population_model(alone.setup(alone.spaces[at], "f/2")).worst(space.curves(point, study.grid.size))
        values = (
            smooth_csd(setup, space.curves(point, study.grid.size), YELLOW_RED)[0],
            warm["csd_yellow_red"][0],
            over,
        )
        found[space.name] = [f"{value:.0f}" for value in values]
    assert printed == found


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
