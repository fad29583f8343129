"""The chromatic separation against brute force over the brightness, and its upper bound against filters."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import trapezoid

from sweep.camera.linear import linear_model
from sweep.camera.setup import Setup
from sweep.metrics.bound import FEASIBLE
from sweep.metrics.chromatic import (
    chromatic_separation,
    chromatic_separations,
    squared_distance,
)
from sweep.search.problem import best_feasible, starting_points
from sweep.search.solver import search_from
from sweep.search.upper_bound import upper_bound_of
from sweep.study.load import load_study

STUDIES = Path(__file__).parents[2] / "studies"
PAIR = ("yellow", "red")


def least_over_brightness(fixed: np.ndarray, scaled: np.ndarray) -> np.ndarray:
    """Least |fixed - a scaled| over a from 0 to a million, by golden sections of a convex function."""
    golden = (np.sqrt(5) - 1) / 2
    low, high = np.zeros(len(fixed)), np.full(len(fixed), 1e6)
    for _ in range(120):
        one, other = high - golden * (high - low), low + golden * (high - low)
        distances = [np.linalg.norm(fixed - a[:, None] * scaled, axis=1) for a in (one, other)]
        low, high = np.where(distances[0] < distances[1], [low, other], [one, high])
    return np.linalg.norm(fixed - ((low + high) / 2)[:, None] * scaled, axis=1)


def smooth_chromatic(setup: Setup, curves: np.ndarray, pair: tuple[str, str]) -> np.ndarray:
    """Chromatic separation of the response before clipping and rounding, the smallest over the cases, DN."""
    model, members = linear_model(setup), [setup.members[name] for name in pair]
    response = model.smooth(curves) - model.unlit(curves)[:, :, None]
    return np.min([chromatic_separation(response[:, case], *members) for case in range(response.shape[1])], axis=0)


@pytest.mark.parametrize("channels", [2, 3, 4])
def test_distance_equals_brute_force_over_brightness(channels: int) -> None:
    rng = np.random.default_rng(channels)
    first, second = (rng.uniform(-100, 4000, (10_000, channels)) for _ in PAIR)
    second[:3000] = first[:3000] * rng.uniform(0.2, 5, (3000, 1)) + rng.normal(0, 20, (3000, channels))
    expected = np.minimum(least_over_brightness(first, second), least_over_brightness(second, first))
    np.testing.assert_allclose(np.sqrt(squared_distance(first, second)), expected, rtol=1e-9, atol=1e-6)
    compiled = chromatic_separations(np.stack([first, second], axis=1), {"a": np.array([0]), "b": np.array([1])})
    np.testing.assert_allclose(compiled["a", "b"], expected, rtol=1e-9, atol=1e-6)


def test_an_unknown_response_has_an_unknown_distance() -> None:
    response = np.array([[[1.0, 2.0], [np.nan, 1.0]], [[0.0, 0.0], [1.0, 1.0]]])
    distances = chromatic_separation(response, np.array([0]), np.array([1]))
    assert np.isnan(distances[0])
    assert distances[1] == 0.0


def test_no_filter_exceeds_the_upper_bound() -> None:
    study = load_study(STUDIES / "chromatic.yaml")
    assert study.search is not None
    problem = study.problem(study.search)
    limit = upper_bound_of(problem)
    assert limit.curve is not None
    assert limit.attained == pytest.approx(limit.proven, abs=0.01)
    base = problem.setup.camera.base_qe[0]
    assert smooth_chromatic(problem.setup, limit.curve[None, None], PAIR)[0] == pytest.approx(limit.attained, rel=1e-9)
    rng = np.random.default_rng(1)
    for _ in range(200):
        dip = 1 - rng.uniform(0, 1) * np.exp(
            -(((study.grid.nodes_nm - rng.uniform(600, 680)) / rng.uniform(10, 40)) ** 2)
        )
        curve = base * np.minimum(dip, 1.0)
        steep = np.abs(np.diff(curve)).max() / study.grid.step_nm
        if trapezoid(curve) >= 0.9 * trapezoid(base) and steep <= 0.06 + FEASIBLE:
            assert smooth_chromatic(problem.setup, curve[None, None], PAIR)[0] <= limit.proven


def test_no_answer_exceeds_the_upper_bound_beside_a_worst_case() -> None:
    """Rows of brightness and of production in one program."""
    proven = []
    for least_dn in (10, 256):
        changes = {"production": {"edge_shift_nm": 2}, "constraints.worst_csd_yellow_red": {"min": least_dn}}
        study = load_study(STUDIES / "chromatic.yaml", changes=changes)
        assert study.search is not None
        problem = study.problem(study.search)
        proven.append(upper_bound_of(problem).proven)
        runs = [search_from(problem, 0, u, "SLSQP", 300) for u in starting_points(problem, 3, 1)]
        best = best_feasible([evaluation for run in runs for evaluation in run.log])
        assert best is None or best.objective <= proven[-1] * (1 + 1e-9)
    assert proven[1] < proven[0] - 0.5


def test_lamps_of_different_photons_are_judged_without_brightness(tmp_path: Path) -> None:
    text = "study: a\nsensor: ar0820\nlights: tl16\ncfas: [RGGB]\n"
    (tmp_path / "a.yaml").write_text(text)
    assert load_study(tmp_path / "a.yaml").objective.column == "csd_yellow_red"
    keys = {"intensity_cd": 200, "exposure": {"kind": "fixed", "exposure_s": 1e-4}}
    changes: dict[str, object] = {"scenarios": {"a": keys}}
    study = load_study(tmp_path / "a.yaml", changes=changes)
    assert (study.objective.column, study.warnings) == ("chromatic_csd_yellow_red", ())
    assert load_study(tmp_path / "a.yaml", changes=changes | {"objective": "csd_yellow_red"}).warnings
