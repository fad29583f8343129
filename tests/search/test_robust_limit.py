"""The limit over the places of a sensor, where filters move with the angle of the light: a program of its own agrees."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from sweep.camera.sensor_field import SensorField
from sweep.camera.setup import Setup
from sweep.metrics.smooth import smooth_csd, smooth_response
from sweep.search.problem import Problem
from sweep.search.upper_bound import UpperBound, reason_without_bound, upper_bound_of
from sweep.study import load_study

from ..conftest import STUDIES
from .limit_oracles import is_mixed, limit_checked_by_milp, milp_limit, random_problem, write_study
from .problems import YELLOW_RED

STUDY = load_study(STUDIES / "angle.yaml")
assert STUDY.search is not None
PLACES_DEG = (0.0, 10.0, 20.0)


@cache
def problem() -> Problem:
    given = STUDY.problem(STUDY.search)
    scene = given.setup.scene.model_copy(update={"field": SensorField(cra_deg=PLACES_DEG)})
    return replace(given, setup=replace(given.setup, scene=scene))


def smallest_csd_at(setup: Setup, angles_deg: Iterable[float], curve: np.ndarray) -> float:
    """The smallest yellow/red distance of a filter over chief ray angles, each a scene of its own, DN."""
    smallest = np.inf
    for cra_deg in angles_deg:
        optics = setup.scene.optics.model_copy(update={"cra_deg": float(cra_deg)})
        place = replace(setup, scene=setup.scene.model_copy(update={"field": None, "optics": optics}))
        smallest = min(smallest, float(smooth_csd(place, curve[None, None], YELLOW_RED)[0]))
    return smallest


@cache
def limit() -> UpperBound:
    assert reason_without_bound(problem()) is None
    return upper_bound_of(problem())


def test_its_filter_has_it_at_the_worst_place_and_more_at_the_others() -> None:
    found, setup = limit(), problem().setup
    assert 0 <= found.proven - found.attained <= 2e-3
    assert smallest_csd_at(setup, PLACES_DEG, found.curve) == pytest.approx(found.attained, rel=1e-12)


@pytest.mark.slow
def test_over_all_places_it_is_a_bracket_of_the_worst_one() -> None:
    """Of 200 image heights, each a scene of its own, none is worse for its filter; named places have no lower limit."""
    given = problem()
    field = SensorField(cra_max_deg=20.0, places="any")
    scene = given.setup.scene.model_copy(update={"field": field})
    found = upper_bound_of(replace(given, setup=replace(given.setup, scene=scene)))
    assert 0 <= found.proven - found.attained <= 0.02
    assert found.proven <= limit().proven + 1e-6
    least = smallest_csd_at(given.setup, np.linspace(0, 20, 200), found.curve)
    assert found.attained * (1 - 1e-12) <= least <= found.attained + 0.02


@pytest.fixture(scope="module")
def moving(tmp_path_factory: pytest.TempPathFactory) -> Problem:
    """A coarse problem whose filters move, at three places of the sensor."""
    path = write_study(tmp_path_factory.mktemp("moving"))
    text = path.read_text().replace("base: Y\n", "base: Y\n    technology: {interference: {effective_index: 1.8}}\n")
    path.write_text(text + "scenarios: {lens: {optics: {f_number: 1.6}, field: {cra_deg: [0, 12, 22]}}}\n")
    study = load_study(path)
    return study.problem(study.search)


def agrees_over_the_sensor(template: Problem, seed: int) -> bool:
    """Whether pairs of the best filter lie on both sides; a MILP with a binary per pair and place has the same limit."""
    problem = random_problem(template, seed)
    found = limit_checked_by_milp(problem)
    assert len(smooth_response(problem.setup, problem.setup.camera.base_qe[None])[0]) == 3
    if seed % 2 == 0:  # the other channels tell nothing apart, so the MILP's margin is what is left to the limit
        assert milp_limit(problem, found.proven) == pytest.approx(found.proven, abs=1e-3)
    return is_mixed(problem, found.curve)


def test_sides_at_every_place_are_those_of_a_milp(moving: Problem) -> None:
    assert any(agrees_over_the_sensor(moving, seed) for seed in range(8))
