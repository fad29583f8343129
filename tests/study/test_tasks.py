"""Tasks in a study: every fault is a line, and a study without tasks knows nothing of them."""

from __future__ import annotations

import json
import subprocess
import sys
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sweep.base.errors import OutputError, StudyError
from sweep.report import read_output, study_of
from sweep.report.words import digits
from sweep.spectra.builtin import task_sets
from sweep.spectra.spectrum import Curves, WavelengthGrid
from sweep.study.load import load_study, study_of_keys

from ..build import one_line
from ..commanded import commanded

KEYS: dict[str, Any] = {"study": "tasks", "sensor": "ar0820", "lights": "tl16", "cfas": ["RGGB"]}
LEAF = {"classes": {"leaf": "canopy", "ground": ["soil", "asphalt"]}, "under": "d65"}
FILM = {"cfa": "RYNCy", "channel": "N", "base": "Y", "to": "G", "at": "paper_N4"}
FILM_OF_LAYERS = {**FILM, "technology": {"interference": {"effective_index": 1.8}}}
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
    ({"tasks": ["color"], "objective": "color_delta_e_mean_d65"}, "allowed: `{least: {color_delta_e_mean_d65: 1}}`"),
    ({"tasks": ["color"], "objective": {"least": {"color_smi": 1}}}, "more of color_smi is better"),
    ({"tasks": ["low_light"], "constraints": {"color_smi": {"min": 80}}}, "unknown quantity"),
    ({"tasks": ["color"], "cfas": ["RYNCy"], "designs": {"film": FILM_OF_LAYERS}}, "do not move with the angle"),
]


@pytest.mark.parametrize(("keys", "said"), FAULTS)
def test_a_fault_of_tasks_is_a_line(keys: dict[str, Any], said: str) -> None:
    with one_line(said, alone=False):
        study_of_keys({**KEYS, **keys}, Path())


def test_tasks_end_with_their_spectra() -> None:
    wave = np.arange(400.0, 721.0, 5)
    keys = {
        **KEYS,
        "sensor": {"files": [{"file": "own.csv", "columns": {"R": "x", "G": "x", "B": "x"}}]},
        "lights": {"files": [{"file": "own.csv", "quantity": "photons", "signals": {"red": ["x"], "green": ["x"]}}]},
        "objective": "csd_red_green",
        "wavelengths": {"start_nm": 400.0, "stop_nm": 720.0, "step_nm": 5.0},
    }
    given = {"own.csv": Curves(wave, {"x": np.full(wave.size, 0.5)}, "own")}
    assert study_of_keys(keys, Path(), given).tasks is None
    with pytest.raises(StudyError, match="the spectra of the tasks end before the grid"):
        study_of_keys({**keys, "tasks": "all"}, Path(), given)


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
    assert [task.columns.name for task in own.tasks.tasks] == ["leaf"]


@pytest.mark.slow
def test_without_tasks_nothing_of_them_is_imported() -> None:
    script = """
import sys
from pathlib import Path
from sweep.study.load import study_of_keys
from sweep.metrics.evaluate import designed_quantities
import numpy as np
study = study_of_keys({"study": "x", "sensor": "ar0820", "lights": "tl16", "cfas": ["RGGB"]}, Path())
designed_quantities(study.setup(study.spaces[0], "chart"), np.empty((1, 0, study.grid.size)))
assert not {"sweep.study.tasks", "sweep.spectra.builtin.spectra", "sweep.spectra.builtin.task_sets"} & set(sys.modules)
assert not any(name.startswith("task") or "delta" in name for name in study.quantities)
"""
    subprocess.run([sys.executable, "-c", script], check=True)


PAINTS = "nm,white,yellow,black\n390,0.5,0.1,0\n550,0.6,0.1,0\n560,0.6,0.5,0\n710,0.6,0.5,0\n"
OWN = {"file": "paints.csv", "quantity": "reflectance"}
WHITE = {**OWN, "columns": ["white"]}
FILES: list[tuple[Any, tuple[str, ...]]] = [
    ({**WHITE, "file": "paint.csv"}, ("no such file (got 'paint.csv')", "did you mean 'paints.csv'")),
    ({**WHITE, "quantity": "transmission"}, ("'energy', 'photons' or 'reflectance'",)),
    ({**OWN, "columns": ["white", "yelow"]}, ("unknown column of paints.csv (got 'yelow'); allowed: white, yellow,",)),
    ({**OWN, "columns": ["white", "white"]}, ("a column is named twice",)),
    ({**OWN, "columns": ["black"]}, ("the surface reflects nothing on the wavelength grid (got 'black')",)),
    ({**WHITE, "quantity": "energy"}, ("a task is of lamps, or of surfaces",)),
    ({**WHITE, "quantty": "energy"}, ("quantty: unknown key; allowed: file, quantity, columns",)),
    ({**OWN, "file": "short.csv", "columns": ["a"]}, ("short.csv, column a: the curve is truncated",)),
    ("paints.csv", ("allowed: {file: paints.csv, quantity: reflectance}, or energy, or photons",)),
    ([WHITE, {**OWN, "columns": ["yellow"]}], ("the class has this file already",)),
]


def with_paints(folder: Path, entry: Any, under: str = "d65") -> dict[str, Any]:
    (folder / "paints.csv").write_text(PAINTS)
    (folder / "short.csv").write_text("nm,a\n500,1\n600,1\n")
    own = {"paint": {"classes": {"mine": entry, "road": "asphalt"}, "under": under}}
    return {**KEYS, "tasks": {"shipped": [], "own": own}}


@pytest.mark.parametrize(("entry", "said"), FILES)
def test_a_fault_of_a_file_is_a_line(tmp_path: Path, entry: Any, said: tuple[str, ...]) -> None:
    with one_line("tasks.own.paint.classes", *said):
        study_of_keys(with_paints(tmp_path, entry), tmp_path)


def test_spectra_of_a_file_are_judged_as_those_of_a_group(tmp_path: Path) -> None:
    """A group written to a file, in percent, is that group; a lamp's energy are its photons times 1 / wavelength."""
    grid = WavelengthGrid()
    road = task_sets.spectra_of_group(grid, "asphalt")
    lamps = task_sets.spectra_of_group(grid, "brake red") * 1e3
    for name, spectra in (("road", road * 100), ("lamps", lamps / grid.nodes_nm)):
        table = np.column_stack([grid.nodes_nm, spectra.T])
        header = ",".join(["nm", *(f"s{at}" for at in range(len(spectra)))])
        np.savetxt(tmp_path / f"{name}.csv", table, delimiter=",", header=header, comments="", fmt="%.17g")
    files = {"file": "road.csv", "quantity": "reflectance"}, {"file": "lamps.csv", "quantity": "energy"}
    made, same = (
        study_of_keys(
            {
                **KEYS,
                "tasks": {
                    "shipped": [],
                    "own": {
                        "surface": {"classes": {"a": surface, "b": "canopy"}, "under": "hps"},
                        "lamp": {"classes": {"a": lamp, "b": ["turn amber"]}},
                    },
                },
            },
            tmp_path,
        )
        for surface, lamp in (files, ("asphalt", "brake red"))
    )
    for one, other in zip(made.tasks.tasks, same.tasks.tasks, strict=True):
        assert one.types == other.types
        np.testing.assert_allclose(one.photons, other.photons, rtol=1e-12, atol=0)
    assert made.digests.keys() == {"road.csv", "lamps.csv"}


@pytest.mark.usefixtures("plain_pictures")
def test_a_run_keeps_the_spectra_of_user_tasks(tmp_path: Path) -> None:
    """It is made again without the file; with another file of that name it is refused."""
    study = {
        **with_paints(tmp_path, {**OWN, "columns": ["white", "yellow"]}),
        "objective": {"least": {"paint_error_d65": 1}},
    }
    (tmp_path / "own.yaml").write_text(json.dumps(study))
    code, told, said = commanded("run", tmp_path / "own.yaml", "--output", tmp_path, "--jobs", 1)
    assert code == 0, said
    output = read_output(tmp_path / "tasks")
    error = output.table["paint_error_d65"].iloc[0]
    assert f"a paint pairwise error under daylight of {digits(error)}" in told
    assert list(output.curves.tasks) == [("paint mine", "paints.csv:white"), ("paint mine", "paints.csv:yellow")]
    assert output.provenance.data_sha256["paints.csv"] == sha256(PAINTS.encode()).hexdigest()
    first = load_study(tmp_path / "own.yaml").tasks
    (tmp_path / "paints.csv").unlink()
    again = study_of(output, None).tasks
    assert first is not None
    assert again is not None
    np.testing.assert_array_equal(first.tasks[0].photons, again.tasks[0].photons)
    (tmp_path / "paints.csv").write_text(PAINTS.replace("0.5", "0.4"))
    with pytest.raises(OutputError, match=r"these differ from the run: .*paints.csv:yellow"):
        study_of(output, tmp_path)
