"""The limit of d': no filter exceeds it, whatever its noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog

from sweep.camera.linear import linear_model
from sweep.camera.scene import Scene
from sweep.metrics.bound import Bound
from sweep.metrics.objective import Objective
from sweep.metrics.smooth_noise import smooth_detectability
from sweep.search.least_noise import least_variance
from sweep.search.problem import Problem
from sweep.search.upper_bound import reason_without_bound, upper_bound_of

from .limit_oracles import halved
from .problems import YELLOW_RED, best_of, filters, noisy_problem

GOAL = Objective(minimum={"dprime_yellow_red": 1.0})
SCENES = {
    "chart": {"noise": True, "exposure": {"kind": "white_patch", "level": 0.3}},
    "far": {"noise": {"prnu": 0.05}, "target": {"distance_m": 150, "fov_deg": 60, "phase_px": [0.3, 0.7]}},
    "pulsed": {
        "noise": True,
        "background_cd_m2": 50,
        "exposure": {"kind": "fixed", "exposure_s": 8e-3},
        "drive": {"duty": 0.5, "frequency_hz": 90},
    },
}


def problem_in(scene: str) -> Problem:
    problem = noisy_problem("stopband", 5, 0.3, GOAL)
    scenario = Scene.model_validate(SCENES[scene])
    setup = replace(problem.setup, scene=scenario, left_out=frozenset())
    setup = setup.with_camera(pixel=scenario.noise.of(setup.camera.pixel))
    return replace(problem, setup=setup, constraints={"sensitivity": Bound(min=0.9)})


def test_each_error_without_upper_bound_has_a_reason() -> None:
    problem = problem_in("chart")
    without = [q for q in problem.quantities.values() if q.states and q.goal and not q.has_limit]
    errors = {"error", "state_error", "chromatic_error"}
    assert {q.metric for q in without} == {"chromatic_dprime", *errors}
    for quantity in without:
        rule = "least" if quantity.direction == "less" else "minimum"
        requested = replace(problem, objective=Objective.model_validate({rule: {quantity.name: 1.0}}))
        assert f"{quantity.name} is not convex" in (reason_without_bound(requested) or "")
    assert reason_without_bound(problem) is None


@pytest.mark.parametrize("scene", SCENES)
def test_no_filter_has_less_noise_or_a_larger_d_prime(scene: str) -> None:
    problem = problem_in(scene)
    imager, base = linear_model(problem.setup), problem.setup.camera.base_qe[0]
    curves = filters(problem, 200)[:, None]
    row, channel = halved(np.ones_like(base)) / halved(base).sum(), problem.setup.camera.modified[0]
    least = least_variance(imager, base, (np.zeros_like(base), base), row, 0.9)
    assert (imager.variance(curves)[..., channel] >= least).all()
    limit = upper_bound_of(problem)
    reached = smooth_detectability(problem.setup, curves, YELLOW_RED)
    assert reached.max() <= limit.proven
    best = best_of(problem, 2, 120)
    assert reached.max() < best.objective <= limit.proven
    own = smooth_detectability(problem.setup, limit.curve[None, None], YELLOW_RED)[0]
    assert limit.attained == pytest.approx(own, rel=1e-12)
    assert limit.attained <= limit.proven


def test_the_least_light_is_that_of_a_linear_program() -> None:
    problem = problem_in("chart")
    imager, base = linear_model(problem.setup), problem.setup.camera.base_qe[0]
    row, channel, gain = (
        halved(np.ones_like(base)) / halved(base).sum(),
        problem.setup.camera.modified[0],
        problem.setup.camera.pixel.dn_per_e,
    )
    no_prnu = problem.setup.with_camera(pixel=problem.setup.camera.pixel.model_copy(update={"prnu": 0.0}))
    least = least_variance(linear_model(no_prnu), base, (0.2 * base, base), row, 0.9)[0]
    light = imager.per_qe(0, base[None])[0, :, channel] / gain
    for signal in (0, 20, 40):
        found = linprog(light[signal], A_ub=-row[None], b_ub=[-0.9], bounds=np.column_stack([0.2 * base, base]))
        expected = gain**2 * (found.fun + 25) + 1 / 12
        assert least[signal] == pytest.approx(expected, rel=1e-9)


def test_bound_between_levels_is_given_only_for_valid_noise() -> None:
    limit = upper_bound_of(problem_in("chart"), sensitivities=(0.85, 0.9, 0.95))
    below, here, above = limit.elsewhere
    assert below == np.inf
    assert above <= here <= limit.proven + 1e-3
