"""Tasks in a study: every fault is a line, spectra of files are those of groups, and a run keeps them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sweep.base.errors import OutputError
from sweep.report import read_output, study_of
from sweep.spectra.builtin.groups import spectra_of_group
from sweep.spectra.spectrum import WavelengthGrid
from sweep.study.load import load_study, study_of_keys

from ...build import one_line
from ...commanded import commanded

KEYS: dict[str, Any] = {"study": "tasks", "sensor": "ar0820", "lights": "tl16", "cfas": ["RGGB"]}
LEAF = {"classes": {"leaf": "canopy", "ground": ["soil", "asphalt"]}, "under": "d65"}
FILM = {"cfa": "RYNCy", "channel": "N", "base": "Y", "to": "G", "at": "paper_N4"}
FILM_OF_LAYERS = {**FILM, "technology": {"interference": {"effective_index": 1.8}}}
FAR_RED = {"sensor": "mt9v024", "lights": "filament", "wavelengths": {"stop_nm": 1000.0, "step_nm": 5.0}}
FAULTS: list[tuple[dict[str, Any], str]] = [
    ({"tasks": ["colour"]}, "tasks.shipped: unknown task"),
    ({"tasks": ["color", "color"]}, "a task is named twice"),
    ({"tasks": {"own": {"color": LEAF}}}, "a task of the package has this name"),
    ({"tasks": {"own": {"leaf": {**LEAF, "under": []}}}}, "surfaces need light; allowed: d65"),
    ({"tasks": {"own": {"leaf": {"classes": {"a": "canopies", "b": "soil"}, "under": "d65"}}}}, "unknown group"),
    ({"tasks": {"own": {"lamp": {"classes": {"a": "brake red", "b": "turn amber"}, "under": "a"}}}}, "their own light"),
    ({"tasks": {"exposure_s": 0.1}}, "a patch of a task fills the well"),
    ({"tasks": ["color"], "constraints": {"color_delta_e_mean_d65": {"min": 1}}}, "has no `min`"),
    ({"tasks": ["color"], "objective": "color_delta_e_mean_d65"}, "allowed: `{least: {color_delta_e_mean_d65: 1}}`"),
    ({"tasks": ["color"], "objective": {"least": {"color_smi": 1}}}, "more of color_smi is better"),
    ({**FAR_RED, "tasks": "all"}, "the spectra of the tasks end before the grid"),
    ({"tasks": ["color"], "cfas": ["RYNCy"], "designs": {"film": FILM_OF_LAYERS}}, "do not move with the angle"),
]


@pytest.mark.parametrize(("keys", "said"), FAULTS)
def test_a_fault_of_tasks_is_a_line(keys: dict[str, Any], said: str) -> None:
    with one_line(said, alone=False):
        study_of_keys({**KEYS, **keys}, Path())


def test_a_study_names_its_tasks() -> None:
    own = study_of_keys({**KEYS, "tasks": {"shipped": [], "own": {"leaf": LEAF}}}, Path())
    tasks = [name for name, quantity in own.quantities.items() if quantity.metric.startswith("task_")]
    assert "leaf_dprime_d65" in tasks
    assert all(name.startswith("leaf_") for name in tasks)


PAINTS = "nm,white,yellow,black\n390,0.5,0.1,0\n550,0.6,0.1,0\n560,0.6,0.5,0\n710,0.6,0.5,0\n"
OWN = {"file": "paints.csv", "quantity": "reflectance"}
WHITE = {**OWN, "columns": ["white"]}
FILES: list[tuple[Any, str]] = [
    ({**WHITE, "file": "paint.csv"}, "no such file"),
    ({**WHITE, "quantity": "transmission"}, "'energy', 'photons' or 'reflectance'"),
    ({**OWN, "columns": ["white", "yelow"]}, "unknown column of paints.csv (got 'yelow')"),
    ({**OWN, "columns": ["white", "white"]}, "a column is named twice"),
    ({**OWN, "columns": ["black"]}, "the surface reflects nothing"),
    ({**WHITE, "quantity": "energy"}, "a task is of lamps, or of surfaces"),
    ({**OWN, "file": "short.csv", "columns": ["a"]}, "short.csv, column a: the curve is truncated"),
    ("paints.csv", "allowed: {file: paints.csv, quantity: reflectance}"),
    ([WHITE, {**OWN, "columns": ["yellow"]}], "the class has this file already"),
]


def with_paints(folder: Path, entry: Any, under: str = "d65") -> dict[str, Any]:
    (folder / "paints.csv").write_text(PAINTS)
    (folder / "short.csv").write_text("nm,a\n500,1\n600,1\n")
    own = {"paint": {"classes": {"mine": entry, "road": "asphalt"}, "under": under}}
    return {**KEYS, "tasks": {"shipped": [], "own": own}}


@pytest.mark.parametrize(("entry", "said"), FILES)
def test_a_fault_of_a_file_is_a_line(tmp_path: Path, entry: Any, said: str) -> None:
    with one_line("tasks.own.paint.classes", said):
        study_of_keys(with_paints(tmp_path, entry), tmp_path)


@pytest.mark.parametrize(
    ("group", "other", "more"), [("asphalt", "canopy", {"under": "hps"}), ("brake red", "turn amber", {})]
)
def test_spectra_of_a_file_are_judged_as_those_of_a_group(
    tmp_path: Path, group: str, other: str, more: dict[str, Any]
) -> None:
    """A group written to a file, in percent, is that group; a lamp's energy are its photons times 1 / wavelength."""
    nodes, spectra = WavelengthGrid().nodes_nm, spectra_of_group(WavelengthGrid(), group)
    table = np.column_stack([nodes, (spectra * 100 if more else spectra / nodes).T])
    header = ",".join(["nm", *(f"s{at}" for at in range(len(spectra)))])
    np.savetxt(tmp_path / "own.csv", table, delimiter=",", header=header, comments="", fmt="%.17g")
    found = []
    for one in ({"file": "own.csv", "quantity": "reflectance" if more else "energy"}, group):
        own = {"mine": {"classes": {"a": one, "b": other}, **more}}
        made = study_of_keys({**KEYS, "tasks": {"shipped": [], "own": own}}, tmp_path)
        found.append(made.features["tasks"].tasks[0].photons)
    np.testing.assert_allclose(*found, rtol=1e-12, atol=0)


@pytest.mark.usefixtures("plain_pictures")
def test_a_run_keeps_the_spectra_of_user_tasks(tmp_path: Path) -> None:
    """It is made again without the file; with another file of that name it is refused."""
    study = {
        **with_paints(tmp_path, {**OWN, "columns": ["white", "yellow"]}),
        "objective": {"least": {"paint_error_d65": 1}},
    }
    (tmp_path / "own.yaml").write_text(json.dumps(study))
    code, _, said = commanded("run", tmp_path / "own.yaml", "--output", tmp_path, "--jobs", 1)
    assert code == 0, said
    output = read_output(tmp_path / "tasks")
    first = load_study(tmp_path / "own.yaml").features["tasks"]
    (tmp_path / "paints.csv").unlink()
    again = study_of(output, None).features["tasks"]
    assert first is not None
    assert again is not None
    np.testing.assert_array_equal(first.tasks[0].photons, again.tasks[0].photons)
    (tmp_path / "paints.csv").write_text(PAINTS.replace("0.5", "0.4"))
    with pytest.raises(OutputError, match=r"not the files of the run: paints.csv"):
        study_of(output, tmp_path)
