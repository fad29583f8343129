"""Own curves beside those of a built-in sensor, as QE and as transmissions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sweep.study.model import Study

from ..build import load, one_line
from ..curve_texts import csv

STUDY = """\
study: tiny
sensor: {builtin: ar0820, files: [{file: own.csv, columns: {COLUMNS}REST}]}
lights: tl16
cfas: [RGGB, RCCB, RYNCy]
"""
NM = np.arange(390.0, 711, 10)


def own(folder: Path, columns: str, rest: str = "", **curves: np.ndarray) -> Study:
    csv(folder, ",".join(["wavelength_nm", *curves]), NM, *curves.values(), name="own.csv")
    return load(folder, STUDY.replace("COLUMNS", columns).replace("REST", rest))


def test_a_qe_stands_beside_the_built_in_ones(tmp_path: Path) -> None:
    study = own(tmp_path, "N: mine", mine=NM / 1000)
    np.testing.assert_allclose(study.sensor.curve("N"), study.grid.nodes_nm / 1000)
    assert study.sensor.clear == "C"
    assert study.sensor.surrogate
    assert {"R", "G", "B", "Y", "Cy", "Rx"} < set(study.sensor.qe)
    assert "RYNCy" in [space.name for space in study.spaces]


def test_a_transmission_is_multiplied_by_its_curve(tmp_path: Path) -> None:
    study = own(tmp_path, "N: t", ", relative_to: Y, scale: 0.01", t=np.full(NM.size, 40.0))
    np.testing.assert_allclose(study.sensor.curve("N"), 0.4 * study.sensor.curve("Y"), rtol=1e-12)


def test_a_user_curve_replaces_the_built_in_one_in_every_cfa(tmp_path: Path) -> None:
    study = own(tmp_path, "R: mine, N: mine", mine=np.full(NM.size, 0.25))
    for cfa in ("RGGB", "RCCB"):
        space = next(space for space in study.spaces if space.name == cfa)
        np.testing.assert_allclose(study.setup(space, "chart").camera.qe[0], 0.25)


@pytest.mark.parametrize(
    ("columns", "rest", "said"),
    [
        ("N: mine", ", relative_to: Yy", "relative_to: unknown curve (got 'Yy')"),
        ("N: mine", ", scale: 1", "QE above 1 (looks like percent: set `scale: 0.01`)"),
        ("N: other", "", "unknown column of own.csv"),
    ],
)
def test_faults_name_the_place(tmp_path: Path, columns: str, rest: str, said: str) -> None:
    (tmp_path / "own.csv").write_text("wavelength_nm,mine\n390,40\n710,40\n")
    with one_line("tiny.yaml:2: sensor.files[0]", said):
        load(tmp_path, STUDY.replace("COLUMNS", columns).replace("REST", rest))
