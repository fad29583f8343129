"""Searches for what tasks measure, be more of it wanted or less, against many designs of the same box."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sweep.metrics.bound import FEASIBLE
from sweep.metrics.evaluate import designed_quantities
from sweep.search.problem import best_feasible, starting_points
from sweep.search.solver import search_from
from sweep.study.load import study_of_keys

BOX = {"cfa": "RYNCy", "channel": "N", "base": "Y", "to": "G"}
KEYS: dict[str, Any] = {
    "study": "tasks",
    "sensor": "ar0820",
    "lights": "tl16",
    "wavelengths": {"start_nm": 400.0, "stop_nm": 700.0, "step_nm": 5.0},
    "cfas": ["RYNCy"],
    "tasks": ["color", "low_light"],
    "boxes": {
        "edges": {
            **BOX,
            "box": {"left_nm": [560, 660], "left_width_nm": 20, "right_nm": [600, 690], "right_width_nm": 20},
        }
    },
    "constraints": {"sensitivity": {"min": 0.8}},
    "search": {"starts": 6, "max_evaluations": 100},
}
SMI, DELTA_E, LUX = "color_smi", "color_delta_e_mean_d65", "low_light_lux_a"


@pytest.mark.parametrize(
    ("name", "objective", "algorithm"),
    [
        pytest.param(SMI, SMI, "SLSQP", marks=pytest.mark.slow),
        (DELTA_E, {"least": {DELTA_E: 1}}, "SLSQP"),
        pytest.param(DELTA_E, {"least": {DELTA_E: 1}}, "COBYLA", marks=pytest.mark.slow),
        (LUX, {"least": {LUX: 0.01}}, "SLSQP"),
    ],
)
def test_the_search_is_as_good_as_the_best_of_many(name: str, objective: Any, algorithm: str) -> None:
    """Not worse than designs drawn from the box, and what it says of its answer is what the rows say."""
    study = study_of_keys({**KEYS, "objective": objective}, Path())
    problem = study.problem(study.search)
    rng = np.random.default_rng(1)
    drawn = problem.from_unit(rng.random((150, problem.free.size)))
    drawn = drawn[(problem.family.violation(drawn) <= 0).all(axis=1)]
    columns = designed_quantities(problem.setup, problem.family.curves(drawn))
    sign = 1 if problem.quantities[name].direction == "more" else -1
    best = max(sign * value for value, s in zip(columns[name], columns["sensitivity"], strict=True) if s >= 0.8)
    points = starting_points(problem, study.search.starts, 1)
    log = [
        e for i, u in enumerate(points) for e in search_from(problem, i, u, algorithm, study.search.max_evaluations).log
    ]
    found = best_feasible(log)
    told = designed_quantities(problem.setup, problem.family.curves(found.x[None]))
    assert sign * told[name][0] >= best - 1e-9 * abs(best)
    assert told["sensitivity"][0] >= 0.8 - FEASIBLE
    assert found.objective == pytest.approx(study.objective.of(told)[0], rel=1e-9)
