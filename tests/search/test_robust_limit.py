"""The limit over the places of a sensor, where filters move with the angle of the light: a program of its own agrees."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from sweep.camera.field import setup_at
from sweep.camera.sensor_field import SensorField
from sweep.camera.setup import Setup
from sweep.metrics.smooth import smooth_csd, smooth_response
from sweep.search.problem import Problem
from sweep.search.upper_bound import UpperBound, reason_without_bound, upper_bound_of
from sweep.study import load_study

from ..conftest import STUDIES
from .limit_oracles import is_mixed, limit_checked_by_milp, milp_limit, random_problem, write_study
from .problems import YELLOW_RED, best_of

STUDY = load_study(STUDIES / "angle.yaml")
assert STUDY.search is not None
PLACES_DEG = (0.0, 10.0, 20.0)


@cache
def problem() -> Problem:
    given = STUDY.problem(STUDY.search)
    scene = given.setup.scene.model_copy(update={"field": SensorField(cra_deg=PLACES_DEG)})
    return replace(given, setup=replace(given.setup, scene=scene))


def worst_of_all_places_dn(setup: Setup, curves: np.ndarray) -> float:
    """The smallest yellow/red distance of a filter at any of 401 image heights, ndarray[1, n_wavelengths]; DN."""
    heights = np.linspace(0, 1, 401)
    return min(float(smooth_csd(setup_at(setup, float(h)), curves[None], YELLOW_RED)[0]) for h in heights)


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
    assert found.attained <= least <= found.attained + 0.02


@pytest.fixture(scope="module")
def moving(tmp_path_factory: pytest.TempPathFactory) -> Problem:
    """A coarse problem whose filters move, at three places of the sensor."""
    path = write_study(tmp_path_factory.mktemp("moving"), 10)
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


FREE_FORM = (
    "{cfa: RYNCy, channel: N, base: Y, technology: {interference: {effective_index: 1.8}}, family: free_form, "
    "options: {nodes: {start_nm: 560, stop_nm: 700, step_nm: 4}}}"
)


@pytest.mark.slow
def test_free_form_filters_come_near_the_limit_over_the_whole_sensor() -> None:
    """`sweep run angle --set boxes.edges=FREE_FORM`: the figure of the documentation, at all places of the sensor."""
    study = load_study(STUDIES / "angle.yaml", changes={"boxes.edges": FREE_FORM})
    searched = study.problem(study.search)
    curves = searched.family.curves(best_of(searched, 1, 200).x[None])
    worst_dn = worst_of_all_places_dn(searched.setup, curves[0])
    proven = upper_bound_of(searched).proven
    assert worst_dn <= proven
    text = " ".join((STUDIES / "guide" / "06-lamps-angles-tolerances.md").read_text(encoding="utf-8").split())
    below = 1 - worst_dn / proven
    assert f"Free-form filters reach {worst_dn:.0f} DN, {below:.1%} below the limit".replace("%", " %") in text
    assert below <= 0.1


@pytest.mark.slow
def test_the_table_of_the_documentation() -> None:
    """Each figure in `studies/guide/06-lamps-angles-tolerances.md`: where nothing moves, on axis, at the worst of all places."""
    text = (STUDIES / "guide" / "06-lamps-angles-tolerances.md").read_text(encoding="utf-8")
    rows = [
        line.strip("|").split("|") for line in text.split("worst over CRA 0 to 20 degrees, f/1.6 |")[1].splitlines()[2:]
    ]
    printed = {row[0].strip(): [cell.strip() for cell in row[1:]] for row in rows[: [len(r) for r in rows].index(1)]}
    found = {}
    for space in STUDY.spaces:
        if space.filter is None or space.gridded:
            setups = STUDY.setup(space, "field"), STUDY.setup(space, "f/1.6 cra_deg=0"), STUDY.setup(space, "field")
            setups = (setups[0].with_camera(technologies=()), *setups[1:])
            curves = space.curves(space.points(0, 1), STUDY.grid.size)
            found[space.name] = [f"{smooth_csd(setup, curves, YELLOW_RED)[0]:.0f}" for setup in setups[:2]]
            found[space.name].append(f"{worst_of_all_places_dn(setups[2], curves[0]):.0f}")
    still = STUDY.problem(STUDY.search)
    limits = upper_bound_of(replace(still, setup=still.setup.with_camera(technologies=()))), upper_bound_of(still)
    found["upper bound"] = [f"{limits[0].proven:.0f}", "", f"{limits[1].proven:.0f}"]
    assert printed == found
