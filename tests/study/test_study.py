"""Study files: what is right loads, what is wrong gets one line with file:line, key, value, allowed, nearest name."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from sweep.study import folder_name

from ..build import BASE, issues, load, one_line
from ..curve_texts import csv

SENSOR_FILE = "sensor:\n  files:\n    - {file: qe.csv, columns: {R: R, C: C}}\n"
LIGHT_FILE = "lights:\n  files:\n    - {file: led.csv, quantity: energy, signals: {red: [r], green: [g]}}\n"


def test_a_study_is_resolved(tmp_path: Path) -> None:
    study = load(tmp_path, BASE)
    assert [(s.kind, s.name, s.size) for s in study.spaces] == [
        ("reference", "RGGB", 1),
        ("design", "mine", 1),
        ("sweep", "edges", 12),
    ]
    edges = study.spaces[2]
    every = [[left, width, 650, right, 1] for left in (590, 600, 610) for width in (5, 10) for right in (5, 25)]
    assert edges.points(0, 12).tolist() == every
    assert edges.points(5, 7).tolist() == every[5:7]


@pytest.mark.parametrize(
    ("qe", "expected"),
    [
        ("wavelength_nm,R,C\n400,2,5\n700,2,5\n", "qe.csv, column R: values up to 5 are no QE"),
        ("wavelength_nm,R,C\n450,0.1,0.5\n700,0.2,0.5\n", "qe.csv, column R: the curve is truncated"),
        (
            "wavelength_nm,r,C\n400,0.1,0.5\n700,0.2,0.5\n",
            "unknown column of qe.csv (got 'R'); did you mean 'r'?; allowed: r, C",
        ),
    ],
)
def test_a_wrong_curve_file_is_a_fault_of_the_study(tmp_path: Path, qe: str, expected: str) -> None:
    (tmp_path / "qe.csv").write_text(qe)
    with one_line(expected, alone=False):
        load(tmp_path, f"study: s\n{SENSOR_FILE}lights: tl16\ncfas: [RCCC]\n")


def test_lights_from_files(tmp_path: Path) -> None:
    (tmp_path / "led.csv").write_text("wavelength_nm,r,g\n390,0,1\n400,0,1\n500,0,1\n600,0,0\n640,1,0\n700,0,0\n")
    text = f"study: s\nsensor: ar0820\n{LIGHT_FILE}cfas: [RGGB]\nobjective: csd_red_green\n"
    study = load(tmp_path, text)
    assert study.lights.classes == ("green", "red")
    assert any("lie outside the wavelength grid" in warning for warning in study.warnings)
    # energy times wavelength is photons: the red triangle is symmetric in neither
    red = study.lights.photons[1]
    assert red[235] / red[240] == pytest.approx(35 / 40 * 635 / 640, rel=1e-3)
    (tmp_path / "led.csv").write_text("wavelength_nm,r,g\n400,0,1\n700,0,0\n")
    assert "no photons" in issues(tmp_path, text)[0]


@pytest.mark.parametrize(
    ("line_nm", "said"),
    [
        (602.4, r"led.csv: r: sampled every 5 nm it has 0\.0% of its photons instead of 100\.0%"),
        (600.0, r"led.csv: r: sampled every 5 nm it has 4[67]\d\.\d% of its photons instead of 100\.0%"),
        (720.0, r"led.csv: r: 100\.0% of its photons lie outside the wavelength grid"),
        (None, "^$"),
    ],
)
def test_a_line_between_nodes_is_not_outside_the_grid(tmp_path: Path, line_nm: float | None, said: str) -> None:
    """A line 1 nm wide, 5 nm / (1.064 * 1 nm) of its photons where it is on a node, or a smooth light."""
    nm = np.arange(380.0, 750.0, 0.1)
    smooth = np.exp(-4 * np.log(2) * ((nm - 550) / 30) ** 2)
    line = smooth if line_nm is None else 1e-6 * smooth + np.exp(-4 * np.log(2) * (nm - line_nm) ** 2)
    csv(tmp_path, "wavelength_nm,r,g", nm, line, smooth, name="led.csv")

    notes = []
    for step_nm, resampling in ((5, "linear"), (0.5, "linear"), (5, "mean")):
        lights = LIGHT_FILE.replace("energy", f"energy, resampling: {resampling}")
        grid = f"wavelengths: {{step_nm: {step_nm:g}}}\n"
        study = load(tmp_path, f"study: s\nsensor: ar0820\n{lights}{grid}cfas: [RGGB]\nobjective: csd_red_green\n")
        notes.append("".join(warning for warning in study.warnings if "photons" in warning))
    assert re.search(said, notes[0])
    assert notes[1:] == [notes[0] if line_nm == 720 else ""] * 2


def test_folder_names_stay_inside_the_output() -> None:
    assert [folder_name(name) for name in ("a-b", "../../etc", "..")] == ["a-b", ".._.._etc", "_"]


def test_columns_of_signal_types_must_differ(tmp_path: Path) -> None:
    (tmp_path / "led.csv").write_text("wavelength_nm,x\n400,1\n700,1\n")
    types = "{a: [x], a_b: [x], b: [x], b_b: [x], a_b_b: [x]}"
    text = BASE.replace(
        "lights: tl16\n", f"lights:\n  files:\n    - {{file: led.csv, quantity: energy, signals: {types}}}\n"
    )
    found = issues(tmp_path, text.replace("constraints:\n", "objective: csd_a_b\nconstraints:\n"))
    assert "the pairs a/b_b and a_b/b share the column csd_a_b_b" in found[0]


def test_pairs_of_signal_types_have_no_order(tmp_path: Path) -> None:
    goals = "objective: csd_yellow_red\nconstraints: {chromatic_csd_yellow_red: {min: 1}}\n"
    text = BASE.split("constraints:")[0] + goals
    plain, turned = load(tmp_path, text), load(tmp_path, text.replace("yellow_red", "red_yellow"))
    assert turned.objective == plain.objective
    assert turned.constraints == plain.constraints


def test_a_study_needs_designs(tmp_path: Path) -> None:
    text = "study: tiny\nsensor: ar0820\nlights: tl16\ncfas: [RYNCy]\nboxes: {x: {cfa: RYNCy, channel: N, base: Y, to: G}}\n"
    assert "cfas: no designs" in issues(tmp_path, text)[0]
    assert load(tmp_path, text + "search: {starts: 2, max_evaluations: 10}\n").n_designs == 0
