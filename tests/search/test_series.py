"""A search for the worst of several scenarios, and under the noise of an HDR pixel."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from sweep.camera.linear import linear_model
from sweep.camera.model import SceneModel
from sweep.camera.pixel import Pixel
from sweep.camera.scene import Scene
from sweep.metrics.objective import Objective
from sweep.metrics.smooth import SmoothDesign
from sweep.search.problem import Problem
from sweep.search.solver import smooth_objective
from sweep.search.upper_bound import reason_without_bound, upper_bound_of

from ..build import issues, load, ran
from .problems import STATES, best_of, best_random, problem_of, rows_at

CHROMATIC = Objective(minimum={"chromatic_dprime_yellow_red": 1.0})
SCENE: dict[str, Any] = {
    "optics": {"f_number": 2.0},
    "exposure": {"kind": "fixed", "exposure_s": 0.011},
    "noise": True,
}
WEIGHTED = {"captures": "split_pixel", "merge": "weighted", "prnu": 0.01}
LAMP = {"target": True}
OWN_QE = {"captures": [{"well_e": 9000}, {"sensitivity": 0.02, "well_e": 8000, "qe_factor": {"N": 0.8, "Cy": 1.1}}]}


def hdr_problem(objective: Objective, intensities_cd: list[float], target: bool = False, **pixel: Any) -> Problem:
    """The search of `stopband` with a split pixel (or another), before lamps of so many candelas."""
    problem = problem_of("stopband")
    given = {"pitch_um": 2.8, "captures": "split_pixel", "offset_dn": 64.0, "prnu": 0.005, "read_noise_e": 1.0} | pixel
    light = SCENE | ({"target": {"distance_m": 30, "fov_deg": 60, "phase_px": [0.3, 0.1]}} if target else {})
    scenes = [Scene.model_validate(light | {"intensity_cd": cd}) for cd in intensities_cd]
    setups = [replace(problem.setup, scene=scene).with_camera(pixel=Pixel(**given)) for scene in scenes]
    return replace(
        problem,
        setup=setups[0],
        others=tuple((one, problem.family) for one in setups[1:]),
        states=STATES,
        objective=objective,
    )


@pytest.mark.parametrize("pixel", [{}, WEIGHTED, OWN_QE, LAMP], ids=["split", "weighted", "own QE", "lamp"])
@pytest.mark.parametrize("objective", [CHROMATIC, Objective(least={"error_yellow_red": 1.0})], ids=str)
def test_derivatives_of_merged_noise_agree_with_differences(objective: Objective, pixel: dict[str, Any]) -> None:
    """In the dark, at a handover of N, in the small photodiode, and where it is full."""
    problem = hdr_problem(objective, [16.0, 500.0] if pixel == LAMP else [0.5, 16.0, 500.0], **pixel)
    u, step = np.array([0.41, 0.33, 0.57, 0.62]), 1e-4
    own, by_u = rows_at(problem, u)
    scale = np.abs(by_u).max(axis=1) + 1e-6 * np.abs(own) + 1e-9  # differences of saturated signals are rounding
    for k in (0, 3) if pixel == LAMP else range(4):  # whose moments take long, and have no parameters of their own
        off = step * np.eye(4)[k]
        wide, near = (
            (rows_at(problem, u + off / n)[0] - rows_at(problem, u - off / n)[0]) / (2 * step / n) for n in (1, 2)
        )
        # Of a few pairs, none of them near the least, the nearest brightness jumps to another capture there.
        bent = np.abs(near - wide) > 2e-3 * scale
        bent &= own < 1e4  # of a d' of 100 no search sees the slope
        assert bent.mean() < 0.01
        assert own[bent].min(initial=np.inf) > 2 * own.min()
        even = ~bent & (own < 1e4)
        np.testing.assert_allclose((by_u[:, k] / scale)[even], ((4 * near - wide) / 3 / scale)[even], atol=1e-4)


def test_merged_noise_is_that_of_the_readout() -> None:
    """Mean to 1/200 of the noise and variance to 0.3 %, or to rounding."""
    problem = hdr_problem(CHROMATIC, [0.5, 16.0, 90.0, 5000.0], **OWN_QE)
    x = problem.from_unit(np.array([0.41, 0.33, 0.57, 0.62]))
    for setup, _ in problem.scenes:
        mean, variance, *_ = SmoothDesign(linear_model(setup), problem.family, x, problem.free, np.ones(4)).noisy
        read = SceneModel(setup).read_with_noise(problem.family.curves(x[None]))
        assert (np.abs(mean - read.mean[0]) < 5e-3 * np.sqrt(read.variance[0] + 1 / 12)).all()
        np.testing.assert_allclose(variance, read.variance[0], rtol=3e-3, atol=0.084)


def test_a_search_over_intensities_is_for_the_worst() -> None:
    """Better there than random designs and than the best of each single intensity; its worst is of a scenario."""
    problem = hdr_problem(CHROMATIC, [2.0, 17.0, 150.0])
    best = best_of(problem, 2, 120)
    assert best is not None
    alone = [problem.in_scenario(number) for number in range(3)]
    assert best.objective == pytest.approx(min(smooth_objective(one, best.x) for one in alone), rel=1e-12)
    assert best.objective > best_random(problem, 100).objective
    for one in alone:
        of_one = best_of(one, 2, 120)
        assert of_one is not None
        assert of_one.objective >= smooth_objective(one, best.x) * (1 - 1e-6)
        assert smooth_objective(problem, of_one.x) <= best.objective * (1 + 1e-6)
    distance = replace(problem, objective=Objective(minimum={"dprime_yellow_red": 1.0}))
    assert reason_without_bound(distance) == "merged captures under noise, or as codes, are not linear in the filter"


SERIES = """\
study: series
wavelengths: {step_nm: 5}
sensor: ar0820
lights: tl16
scenarios:
  chart: {exposure: {kind: white_patch}}
  bright:
    exposure: {kind: fixed, exposure_s: 0.0002}
    each: {background_cd_m2: [0, 2000, 9000]}
cfas: [RGGB, RYNCy]
boxes:
  band:
    {cfa: RYNCy, channel: N, base: Y, to: G, box: {left_nm: {min: 560, max: 640}, left_width_nm: 6, right_nm: {min: 600, max: 690}, right_width_nm: 6}}
objective: csd_yellow_red
constraints: {sensitivity: {min: 0.9}}
search: {scenario: bright, starts: 4, max_evaluations: 200}
"""


def test_a_run_has_the_answer_in_each_scenario_and_its_bound_in_the_worst(tmp_path: Path) -> None:
    study = load(tmp_path, SERIES)
    ran(study, tmp_path / "out", 1)
    rows = pd.read_parquet(tmp_path / "out" / "results.parquet")
    found = rows[rows["kind"] == "search"]
    assert list(found["scenario"]) == [f"bright background_cd_m2={cd}" for cd in (0, 2000, 9000)]
    assert rows["design_id"].is_unique
    assert found["filter_id"].nunique() == 1
    bounded = found[found["upper_bound"].notna()]
    assert len(bounded) == 1
    problem = study.problem(study.search)
    x = found[list(study.search.space.parameters)].iloc[0].to_numpy(dtype=float)
    values = [smooth_objective(problem.in_scenario(number), x) for number in range(3)]
    assert int(np.argmin(values)) == found.index.get_loc(bounded.index[0])
    # The bound of any scenario is one of the worst value; and no random filter's worst is above it.
    bounds = [upper_bound_of(problem.in_scenario(number)).proven for number in range(3)]
    assert min(values) <= min(bounds) * (1 + 1e-9)
    assert bounded["upper_bound"].iloc[0] == pytest.approx(bounds[int(np.argmin(values))], rel=1e-6)
    assert best_random(problem, 50).objective <= bounded["upper_bound"].iloc[0]


NOISY_SERIES = (
    SERIES.replace("lights: tl16\n", "lights: tl16\nrecognition: {}\npixel: {PIXEL}\n")
    .replace("{kind: white_patch}}", "{kind: fixed, exposure_s: 0.001}, noise: true}")
    .replace("  bright:\n", "  bright:\n    noise: true\n")
    .replace("objective: csd", "objective: dprime")
)
PULSED = NOISY_SERIES.replace("noise: true}", "noise: true, drive: {duty: 0.5, frequency_hz: 90}}")
TWO = "captures: [{}, {sensitivity: 0.1, crosstalk: 0.1}], crosstalk: 0.1"
SUM = "objective: {sum: {csd_yellow_red: 1, csd_green_red: 1}}"


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (SERIES.replace("bright,", "brigt,"), "did you mean 'bright'"),
        (SERIES.replace("200}", "200, front: {min: 0.8, max: 1, count: 3}}"), "search.front: of one scenario"),
        (SERIES.replace("objective: csd_yellow_red", SUM), "objective: the worst"),
        (NOISY_SERIES.replace("PIXEL", TWO), "captures[1].crosstalk: a search"),
        (PULSED.replace("PIXEL", "captures: staggered"), "needs steady light"),
    ],
)
def test_what_has_no_worst_scenario_or_noise_is_refused(tmp_path: Path, text: str, line: str) -> None:
    (found,) = issues(tmp_path, text)
    assert line in found
