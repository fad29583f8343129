"""Study files: what is right loads, what is wrong gets one line with file:line, key, value, allowed, nearest name."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from sweep.study import folder_name, load_study

from ..build import BASE, issues, load, one_line
from ..conftest import STUDIES
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
    assert study.n_designs == 14
    edges = study.spaces[2]
    assert edges.points(0, 12)[[0, 1, 2, 11]].tolist() == [
        [590, 5, 650, 5, 1],
        [590, 5, 650, 25, 1],
        [590, 10, 650, 5, 1],
        [610, 10, 650, 25, 1],
    ]
    assert edges.points(5, 7).tolist() == edges.points(0, 12)[5:7].tolist()
    assert study.objective.column == "csd_yellow_red"


def test_the_measured_study_loads() -> None:
    study = load_study(STUDIES / "measured.yaml")
    assert not study.sensor.surrogate
    assert study.lights.classes == ("green", "yellow", "red")
    # one common scale: both files give the same clear pixel at 630 nm
    assert study.sensor.qe["C"][230] == pytest.approx(study.sensor.qe["W"][230], rel=1e-3)


@pytest.mark.parametrize(
    ("qe", "expected"),
    [
        ("wavelength_nm,R,C\n400,2,5\n700,2,5\n", "qe.csv, column R: values up to 5 are no QE"),
        ("wavelength_nm,R,C\n450,0.1,0.5\n700,0.2,0.5\n", "qe.csv, column R: the curve is truncated"),
        ("wavelength_km,R,C\n0.4,0.1,0.5\n0.7,0.2,0.5\n", "qe.csv:1: wavelength_km: no column wavelength"),
        (
            "wavelength_nm,r,C\n400,0.1,0.5\n700,0.2,0.5\n",
            "unknown column of qe.csv (got 'R'); allowed: r, C; did you mean 'r'?",
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


@pytest.mark.parametrize("quantity", ["energy", "photons"])
@pytest.mark.parametrize(
    ("line_nm", "said"),
    [
        (
            602.4,
            r"led.csv: r: sampled every 5 nm it has 0\.0% of its photons instead of 100\.0%, .*finer `wavelengths: ",
        ),
        (600.0, r"led.csv: r: sampled every 5 nm it has 4[67]\d\.\d% of its photons instead of 100\.0%"),
        (720.0, r"led.csv: r: 100\.0% of its photons lie outside the wavelength grid"),
        (None, None),
    ],
)
def test_a_line_between_nodes_is_not_outside_the_grid(
    tmp_path: Path, line_nm: float | None, said: str | None, quantity: str
) -> None:
    """A line 1 nm wide, 5 nm / (1.064 * 1 nm) of its photons where it is on a node, or a smooth light."""
    nm = np.arange(380.0, 750.0, 0.1)
    smooth = np.exp(-4 * np.log(2) * ((nm - 550) / 30) ** 2)
    line = smooth if line_nm is None else 1e-6 * smooth + np.exp(-4 * np.log(2) * (nm - line_nm) ** 2)
    csv(tmp_path, "wavelength_nm,r,g", nm, line, smooth, name="led.csv")

    def notes(step_nm: float, resampling: str = "linear") -> list[str]:
        lights = LIGHT_FILE.replace("energy", f"{quantity}, resampling: {resampling}")
        grid = f"wavelengths: {{step_nm: {step_nm:g}}}\n"
        study = load(tmp_path, f"study: s\nsensor: ar0820\n{lights}{grid}cfas: [RGGB]\nobjective: csd_red_green\n")
        return [warning for warning in study.warnings if "photons" in warning]

    if said is None:
        assert notes(5) == []
        return
    (note,) = notes(5)
    assert re.search(said, note)
    for others in (notes(0.5), notes(5, "mean")):
        assert others == ([note] if line_nm == 720 else [])


def test_a_light_between_nodes_is_refused_with_the_way_out(tmp_path: Path) -> None:
    (tmp_path / "led.csv").write_text("wavelength_nm,r,g\n390,0,1\n602,0,1\n602.5,1,1\n603,0,1\n710,0,1\n")
    text = (
        f"study: s\nsensor: ar0820\n{LIGHT_FILE}wavelengths: {{step_nm: 5}}\ncfas: [RGGB]\nobjective: csd_red_green\n"
    )
    (said,) = issues(tmp_path, text)
    assert "no photons on the wavelength grid, but between its nodes, 5 nm apart" in said
    assert "allowed: a finer `wavelengths: {step_nm: ...}`, or `resampling: mean`" in said


def test_folder_names_stay_inside_the_output() -> None:
    assert folder_name("stopband") == "stopband"
    assert folder_name("../../etc") == ".._.._etc"
    assert folder_name("..") == "_"
    assert folder_name("<script>") == "_script_"


def test_columns_of_signal_types_must_differ(tmp_path: Path) -> None:
    (tmp_path / "led.csv").write_text("wavelength_nm,x\n400,1\n700,1\n")
    types = "{a: [x], a_b: [x], b: [x], b_b: [x], a_b_b: [x]}"
    text = BASE.replace(
        "lights: tl16\n", f"lights:\n  files:\n    - {{file: led.csv, quantity: energy, signals: {types}}}\n"
    )
    found = issues(tmp_path, text.replace("constraints:\n", "objective: csd_a_b\nconstraints:\n"))
    assert "the pairs a/b_b and a_b/b share the column csd_a_b_b" in found[0]


def test_a_study_needs_designs(tmp_path: Path) -> None:
    text = "study: tiny\nsensor: ar0820\nlights: tl16\ncfas: [RYNCy]\nboxes: {x: {cfa: RYNCy, channel: N, base: Y, to: G}}\n"
    assert "cfas: no designs" in issues(tmp_path, text)[0]
    assert load(tmp_path, text + "search: {starts: 2, max_evaluations: 10}\n").n_designs == 0
