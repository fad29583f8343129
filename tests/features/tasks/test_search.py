"""Searches for what tasks measure, be more of it wanted or less, against many designs of the same box."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sweep.metrics.bound import FEASIBLE
from sweep.metrics.evaluate import designed_quantities
from sweep.study.load import study_of_keys

from ...search.problems import best_of

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
DELTA_E, LUX = "color_delta_e_mean_d65", "low_light_lux_a"


@pytest.mark.parametrize("name", [DELTA_E, LUX])
def test_the_search_is_as_good_as_the_best_of_many(name: str) -> None:
    """Not worse than designs drawn from the box, and what it says of its answer is what the rows say."""
    study = study_of_keys({**KEYS, "objective": {"least": {name: 2}}}, Path())
    problem = study.problem(study.search)
    rng = np.random.default_rng(1)
    drawn = problem.from_unit(rng.random((150, problem.free.size)))
    drawn = drawn[(problem.family.violation(drawn) <= 0).all(axis=1)]
    columns = designed_quantities(problem.setup, problem.family.curves(drawn))
    best = columns[name][columns["sensitivity"] >= 0.8].min()
    found = best_of(problem, study.search.starts, study.search.max_evaluations)
    told = designed_quantities(problem.setup, problem.family.curves(found.x[None]))
    assert told[name][0] <= best * (1 + 1e-9)
    assert told["sensitivity"][0] >= 0.8 - FEASIBLE
    assert found.objective == pytest.approx(study.objective.of(told)[0], rel=1e-9)
