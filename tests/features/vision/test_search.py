"""Searches that look at the ideal observer's error: by algorithms that need no derivatives."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sweep.base.errors import StudyError
from sweep.camera.model import SceneModel
from sweep.metrics.evaluate import evaluate
from sweep.search.problem import best_feasible, starting_points
from sweep.search.solver import refinement_of, search_from
from sweep.study.load import study_of_keys

from ...search.problems import PROBLEM

VISION = {
    "fov_deg": 120,
    "distances_m": [500],
    "intensities_cd": [10],
    "levels": {"day": {"illuminance_lx": 10000, "exposure_s": 5e-5}},
    "crop_px": 8,
    "places_per_pixel": 1,
    "test_images": 200,
}
BOX = {"left_nm": [570, 650], "left_width_nm": 10, "right_nm": 680, "right_width_nm": 10}
KEYS: dict[str, Any] = {
    "study": "vision",
    "sensor": "ar0820",
    "lights": "tl16",
    "wavelengths": {"start_nm": 400.0, "stop_nm": 700.0, "step_nm": 10.0},
    "pixel": {"read_noise_e": 2, "offset_dn": 168},
    "cfas": ["RYNCy"],
    "boxes": {"edges": {"cfa": "RYNCy", "channel": "N", "base": "Y", "to": "G", "box": BOX}},
    "vision": VISION,
    "objective": {"least": {"vision_error": 1}},
    "search": {"algorithm": "COBYLA", "starts": 2, "max_evaluations": 12},
}


@pytest.mark.slow
def test_the_least_error_of_the_observer_is_searched_for() -> None:
    """Not worse than filters evenly over the box; the answer's error is that of the rows."""
    study = study_of_keys(KEYS, Path())
    problem = study.problem(study.search)

    def errors(x: np.ndarray) -> np.ndarray:
        return evaluate(SceneModel(problem.setup), problem.family.curves(x))["vision_error"]

    over = errors(problem.from_unit(np.linspace(0, 1, 5)[:, None]))
    assert over.max() > 1.05 * over.min() > 0
    points = starting_points(problem, 2, 1)
    found = best_feasible([e for i, u in enumerate(points) for e in search_from(problem, i, u, "COBYLA", 12).log])
    assert 10**-found.objective == pytest.approx(errors(found.x[None])[0], rel=1e-9)
    assert 10**-found.objective <= 1.02 * over.min()


def test_only_a_search_with_derivatives_is_refined() -> None:
    study = study_of_keys(KEYS, Path())
    assert refinement_of(study.problem(study.search), "COBYLA") is None
    assert refinement_of(PROBLEM, "COBYLA") == "SLSQP"
    assert refinement_of(PROBLEM, "SLSQP") is None


@pytest.mark.parametrize("change", [{}, {"objective": "csd_yellow_red", "constraints": {"vision_error": {"max": 0.1}}}])
def test_a_search_by_gradients_is_refused(change: dict[str, Any]) -> None:
    keys = {**KEYS, **change, "search": {**KEYS["search"], "algorithm": "SLSQP"}}
    with pytest.raises(StudyError, match="vision_error has no derivatives"):
        study_of_keys(keys, Path())
    assert study_of_keys({**keys, "search": KEYS["search"]}, Path()).search is not None
