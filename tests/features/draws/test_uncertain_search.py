"""The CSD that a share of random sensors has, also with random lamps and edges: as a column, an objective, a judgement."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.optimize import NonlinearConstraint, differential_evolution

from sweep.camera.curve_errors import CurveErrors, linear_in_filter
from sweep.camera.linear import linear_model
from sweep.designs.tolerance import NONE
from sweep.features.draws.uncertainty import _on_sensors
from sweep.metrics.drawn import draws_of
from sweep.metrics.drawn_sensors import RandomSensors
from sweep.metrics.members import population_model
from sweep.metrics.smooth import smooth_csd
from sweep.results.output import read_output
from sweep.search.gradients import Model
from sweep.search.problem import Problem, SearchRun
from sweep.search.solver import search_from, smooth_objective
from sweep.study import Study

from ...build import load, one_line, ran
from ..sensors.test_sensors import own_csd, own_draws

PAIR = ("yellow", "red")
TEXT = """\
study: doubts
sensor: ar0820
lights: tl16
wavelengths: {step_nm: 5}
cfas: [RGGB, RYNCy]
uncertainty: {gain: 0.05, shift_nm: 5, noise: 0.03, ir_cut_nm: 5, draws: 1000, wanted_yield: 0.95}
designs:
  exact: {cfa: RYNCy, channel: N, base: Y, to: G, at: {left_nm: 612.9, left_width_nm: 6, right_nm: 651.2, right_width_nm: 6.3}}
boxes:
  edges:
    cfa: RYNCy
    channel: N
    base: Y
    to: G
    box: {left_nm: [570, 680], left_width_nm: [5, 55], right_nm: [620, 700], right_width_nm: [5, 55]}
objective: yield_csd_yellow_red
constraints: {sensitivity: {min: 0.9}, slope_per_nm: {max: 0.06}}
search: {starts: 4, max_evaluations: 400}
"""
LAMPS = """\
population: {temperature_c: [-40, 85], self_heating_k: 20, binning_nm: 2}
production: {edge_shift_nm: 2}
"""
X = np.array([616.0, 7.0, 653.0, 8.0, 1.0])


def problem_of(study: Study) -> Problem:
    assert study.search is not None
    return study.problem(study.search)


def test_a_yield_of_random_sensors_is_that_of_own_draws(tmp_path: Path) -> None:
    """20,000 sensors by own code: the share of them above the column's value is the wanted one, with its margin."""
    text = (
        "study: doubts\nsensor: opencam\nlights: tl16\nwavelengths: {stop_nm: 664}\ncfas: [RYYCy]\n"
        "uncertainty: {gain: 0.05, shift_nm: 2, noise: 0.03, correlation_nm: 30, ir_cut_nm: 3, draws: 2000, wanted_yield: 0.9}\n"
    )
    ran(load(tmp_path, text), tmp_path / "out", 1)
    found = pd.read_parquet(tmp_path / "out" / "results.parquet")["yield_csd_yellow_red"].iloc[0]
    judged = pd.read_parquet(tmp_path / "out" / "yields.parquet").iloc[0]
    errors = CurveErrors(gain=0.05, shift_nm=2, noise=0.03, correlation_nm=30, ir_cut_nm=3)
    rng = np.random.default_rng(4)
    parts = [own_draws(["R", "Y", "Cy"], 2000, errors, rng) for _ in range(10)]
    own = np.concatenate([own_csd(part, np.array([1.0, 2, 1]))[0] for part in parts])
    assert 0.9 <= (own >= found).mean() <= 0.925
    assert judged["draws"] == 20_000
    assert judged["dn_low"] <= judged["dn"] <= judged["dn_high"]
    shown = read_output(tmp_path / "out").table["yield_csd_yellow_red"].iloc[0]
    assert shown == judged["dn"] != found  # pages say what other draws have
    assert judged["dn"] == pytest.approx(np.quantile(own, 0.1), abs=2 * (judged["dn_high"] - judged["dn_low"]))


def test_a_filter_before_known_curves_is_that_filter(tmp_path: Path) -> None:
    problem = problem_of(load(tmp_path, TEXT))
    uncertain = problem.setup.camera.uncertain
    assert uncertain is not None
    known = CurveErrors(draws=100, gain=0.0, shift_nm=0.0, noise=0.0)
    setup = problem.setup.with_camera(uncertain=replace(uncertain, errors=known))
    curves = problem.family.curves(X[None])
    csds, light, _ = _on_sensors(setup, curves[0], 1)
    assert csds[PAIR] == pytest.approx(np.full(100, smooth_csd(setup, curves, PAIR)[0]), rel=1e-12)
    assert np.ptp(light) < 1e-12


@pytest.mark.parametrize("more", ["", LAMPS, "pixel: {crosstalk: 0.05, offset_dn: 64}\n" + LAMPS])
@pytest.mark.parametrize("tile", ["RYNCy", "RNNB"])
def test_every_draw_is_read_as_a_camera_of_its_curves(tmp_path: Path, more: str, tile: str) -> None:
    """Draws by weights of the filter are those of whole cameras, also where N sets the exposure."""
    study = load(tmp_path, TEXT.replace("RYNCy", tile).replace("draws: 1000", "draws: 200") + more)
    problem = problem_of(study)
    sample = RandomSensors(problem.setup, problem.tolerance, (1, 2))
    families = [problem.family.perturbed(error) for error in sample.production_errors]
    curves = np.stack([family.curves(X[None])[0] for family in families])
    found, starts = sample.distances(curves, [PAIR])[PAIR], sample.starts(PAIR)
    uncertain, camera = problem.setup.camera.uncertain, problem.setup.camera
    assert uncertain is not None
    drawn, order = uncertain.drawn(camera.grid, (1, 2)), np.arange(200)
    model = None if study.lights.population is None else population_model(problem.setup)
    scene = problem.setup if model is None else model.setup
    whole = scene.with_all_effects.with_camera(modified=tuple(range(len(camera.qe))))
    lamps = None if model is None else draws_of(model.members, PAIR, problem.tolerance, (1, 2), 200)
    if lamps is not None:
        order = lamps.order
    (channel,) = camera.modified
    for draw in range(0, 200, 13):
        error = int(np.searchsorted(starts, draw, side="right")) - 1
        one = drawn[order[draw]]
        weights, rest = linear_in_filter(one[None, channel], camera.qe[channel])
        one[channel] = (weights * curves[error] + rest)[0]
        (response,) = linear_model(whole).smooth(one[None])
        if lamps is None:
            first, second = (response[0][whole.members[name]] for name in PAIR)
            own = np.linalg.norm(first[:, None] - second, axis=-1).min()
        else:
            own = np.linalg.norm(lamps.differences(np.array([draw]), response))
        assert found[draw] == pytest.approx(own, rel=1e-9)


@pytest.mark.parametrize("more", ["", LAMPS, LAMPS.replace("{edge_shift_nm: 2}", "{thickness: 0.004}")])
@pytest.mark.parametrize("tile", ["RYNCy", "RNNB"])
def test_derivatives_are_those_of_differences(tmp_path: Path, more: str, tile: str) -> None:
    problem = problem_of(load(tmp_path, TEXT.replace("RYNCy", tile) + more))
    point = Model(problem, SearchRun(0), 10).at(u := problem.to_unit(X))
    step = 1e-6
    slopes = point.terms.by_u[0] / (2 * point.evaluation.objective)  # its terms are squares
    for at in range(u.size):
        values = [
            smooth_objective(problem, problem.from_unit(u + sign * step * np.eye(u.size)[at])) for sign in (1, -1)
        ]
        measured = (values[0] - values[1]) / (2 * step)
        assert slopes[at] == pytest.approx(measured, rel=1e-6, abs=1e-6 * np.abs(slopes).max())


@pytest.mark.slow
def test_differential_evolution_finds_no_more_than_a_search_over_random_cameras(tmp_path: Path) -> None:
    """But for 1 %."""
    problem = problem_of(load(tmp_path, TEXT + LAMPS))
    model = Model(problem, SearchRun(0), 10**6)
    ours = max(
        e.objective
        for start in np.random.default_rng(1).random((4, 4))
        for e in search_from(problem, 0, start, "SLSQP", 100).log
        if e.feasible
    )
    inside = NonlinearConstraint(lambda u: model.at(u).conditions.values, -np.inf, 0.0)
    evolved = differential_evolution(
        lambda u: -model.at(u).evaluation.objective, [(0, 1)] * 4, constraints=inside, seed=1, maxiter=80, polish=False
    )
    assert evolved.constr_violation == 0
    assert -evolved.fun <= 1.01 * ours


def test_a_plain_cfa_and_a_filter_that_changes_nothing_see_the_same_cameras(tmp_path: Path) -> None:
    """Also where production errors, which a plain CFA does not have, sort the draws."""
    problem = problem_of(load(tmp_path, TEXT + LAMPS))
    base = problem.setup.camera.base_qe
    with_errors, without = (RandomSensors(problem.setup, of, (1, 2)) for of in (problem.tolerance, NONE))
    one = with_errors.distances(np.repeat(base[None], len(with_errors.production_errors), axis=0), [PAIR])[PAIR]
    other = without.distances(base[None], [PAIR])[PAIR]
    np.testing.assert_allclose(np.sort(one), np.sort(other), rtol=1e-12)


def test_every_yield_that_is_asked_for_is_judged(tmp_path: Path) -> None:
    text = TEXT.replace(
        "objective: yield_csd_yellow_red", "objective: {minimum: {yield_csd_yellow_red: 1, yield_csd_green_yellow: 1}}"
    )
    ran(load(tmp_path, text.split("search:")[0].replace("draws: 1000", "draws: 200")), tmp_path / "out", 1)
    judged = pd.read_parquet(tmp_path / "out" / "yields.parquet")
    assert set(judged["quantity"]) == {"csd_yellow_red", "csd_green_yellow"}
    assert set(judged["draws"]) == {2000}


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("draws: 1000", "draws: 30000", "takes at most 20,000 `draws`"),
        ("draws: 1000", "draws: 100", "needs at least 200 `draws`"),
        ("objective:", "population: {binning_nm: 2, wanted_yield: 0.99}\nobjective:", "stated of `population`, too"),
        (
            TEXT[TEXT.index("boxes:") :],
            "scenarios: {night: {drive: {duty: 0.5, frequency_hz: 90}}}\n",
            "need a fixed exposure (scenario night)",
        ),
    ],
)
def test_a_mistake_is_one_line(tmp_path: Path, old: str, new: str, line: str) -> None:
    with one_line(line):
        load(tmp_path, TEXT.replace(old, new))
