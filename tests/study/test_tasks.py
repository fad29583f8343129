"""Tasks in a study: every fault is a line, and a study without tasks knows nothing of them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sweep.curves.spectrum import Curves
from sweep.errors import StudyError
from sweep.study.load import study_of_keys

KEYS: dict[str, Any] = {"study": "tasks", "sensor": "ar0820", "lights": "tl16", "cfas": ["RGGB"]}
LEAF = {"classes": {"leaf": "canopy", "ground": ["soil", "asphalt"]}, "under": "d65"}
FAULTS: list[tuple[dict[str, Any], str]] = [
    ({"tasks": ["colour"]}, "tasks.shipped: unknown task (got 'colour'); allowed: color, low_light"),
    ({"tasks": ["color", "color"]}, "a task is named twice"),
    ({"tasks": {"shipped": []}}, "`shipped`, `own`, or both"),
    ({"tasks": {"own": {"color": LEAF}}}, "a task of the package has this name"),
    ({"tasks": {"own": {"Leaf": LEAF}}}, "tasks.own.Leaf"),
    ({"tasks": {"own": {"leaf": {**LEAF, "under": []}}}}, "surfaces need light; allowed: d65"),
    ({"tasks": {"own": {"leaf": {**LEAF, "under": "d56"}}}}, "unknown light (got 'd56')"),
    (
        {"tasks": {"own": {"leaf": {"classes": {"a": "canopies", "b": "soil"}, "under": "d65"}}}},
        "unknown group of spectra (got 'canopies')",
    ),
    (
        {"tasks": {"own": {"lamp": {"classes": {"a": "brake red", "b": "soil"}}}}},
        "a task is of lamps, or of surfaces",
    ),
    (
        {"tasks": {"own": {"lamp": {"classes": {"a": "brake red", "b": "turn amber"}, "under": "a"}}}},
        "lamps are seen by their own light",
    ),
    ({"tasks": {"exposure_s": 0.1}}, "a patch of a task fills the well"),
    ({"tasks": ["color"], "constraints": {"color_delta_e_mean_d65": {"min": 1}}}, "has no `min`"),
    ({"tasks": ["color"], "objective": "color_delta_e_mean_d65"}, "unknown objective"),
    ({"tasks": ["low_light"], "constraints": {"color_smi": {"min": 80}}}, "unknown quantity"),
]


@pytest.mark.parametrize(("keys", "said"), FAULTS)
def test_a_fault_of_tasks_is_a_line(keys: dict[str, Any], said: str) -> None:
    with pytest.raises(StudyError) as found:
        study_of_keys({**KEYS, **keys}, Path())
    assert said in str(found.value)
    assert all("\n" not in str(fault) for fault in found.value.faults)


def test_tasks_end_with_their_spectra() -> None:
    wave = np.arange(400.0, 721.0, 5)
    bell = {name: np.exp(-(((wave - at) / 30) ** 2)) for name, at in (("R", 620), ("G", 540), ("B", 460))}
    files = {
        "sensor": {"files": [{"file": "own.csv", "columns": {name: name for name in bell}}]},
        "lights": {"files": [{"file": "own.csv", "quantity": "photons", "signals": {"red": ["R"], "green": ["G"]}}]},
        "objective": "csd_red_green",
        "wavelengths": {"start_nm": 400.0, "stop_nm": 720.0, "step_nm": 5.0},
    }
    given = {"own.csv": Curves(wave, bell, "own")}
    assert study_of_keys({**KEYS, **files}, Path(), given).tasks is None
    with pytest.raises(StudyError, match="the spectra of the tasks end before the grid"):
        study_of_keys({**KEYS, **files, "tasks": "all"}, Path(), given)


def test_tasks_need_filters_that_do_not_move() -> None:
    film = {
        "cfa": "RYNCy",
        "channel": "N",
        "base": "Y",
        "to": "G",
        "technology": {"interference": {"effective_index": 1.8}},
    }
    keys = {**KEYS, "cfas": ["RYNCy"], "designs": {"film": {**film, "at": "RYN_4Cy"}}, "tasks": ["color"]}
    with pytest.raises(StudyError, match="do not move with the angle"):
        study_of_keys(keys, Path())


def test_a_study_names_its_tasks() -> None:
    short = study_of_keys({**KEYS, "tasks": ["emergency"]}, Path())
    assert [name for name, q in short.quantities.items() if q.metric.startswith("task_")] == [
        "emergency_csd",
        "emergency_dprime",
        "emergency_error",
    ]
    own = study_of_keys({**KEYS, "tasks": {"shipped": [], "own": {"leaf": LEAF}}}, Path())
    assert "leaf_dprime_d65" in own.quantities
    assert own.tasks is not None
    assert [task.key.name for task in own.tasks.tasks] == ["leaf"]


@pytest.mark.slow
def test_without_tasks_nothing_of_them_is_imported() -> None:
    script = """
import sys
from pathlib import Path
from sweep.study.load import study_of_keys
from sweep.metrics.evaluate import designed_quantities
import numpy as np
study = study_of_keys({"study": "x", "sensor": "ar0820", "lights": "tl16", "cfas": ["RGGB"]}, Path())
designed_quantities(study.view(study.spaces[0], "chart"), np.empty((1, 0, study.grid.size)))
assert not any(name.startswith("sweep.metrics.tasks") for name in sys.modules)
assert not {"sweep.study.tasks", "sweep.curves.builtin.spectra", "sweep.curves.builtin.task_sets"} & set(sys.modules)
assert not any(name.startswith("task") or "delta" in name for name in study.quantities)
"""
    subprocess.run([sys.executable, "-c", script], check=True)
