"""Curves whose largest value is 1: a relative response, which is said wherever it is taken for a QE."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sweep.cli.describe import described
from sweep.cli.new import new_study
from sweep.spectra.facts import NORMALIZED
from sweep.study import load_study

NM = np.arange(390.0, 711, 5)
STUDY = """\
study: tiny
sensor: {files: [{file: qe.csv, columns: {R: R, G: G, B: B}, quantity: QUANTITY, SCALE}]}
lights: tl16
cfas: [RGGB]
"""


def qe_file(folder: Path, top: float) -> Path:
    curves = [top * (1 - 1e-9) * np.exp(-(((NM - nm) / 80) ** 2)) for nm in (610, 540, 460)]
    rows = [",".join(map(str, row)) for row in zip(NM, *curves, strict=True)]
    (folder / "qe.csv").write_text("\n".join(["wavelength_nm,R,G,B", *rows]))
    return folder / "qe.csv"


@pytest.mark.parametrize(("top", "normalized"), [(1.0, True), (0.8, False), (0.999, False)])
def test_a_file_with_a_maximum_of_one_gets_a_note_on_normalization(
    tmp_path: Path, top: float, normalized: bool
) -> None:
    qe = qe_file(tmp_path, top)
    assert (f"Note: {NORMALIZED}." in described(qe, tmp_path).lines) == normalized
    assert (f"Note: qe.csv: {NORMALIZED}." in new_study("mine", tmp_path, [qe], [])) == normalized


@pytest.mark.parametrize(
    ("top", "scale", "normalized"),
    [(1.0, "scale: 1", True), (1.0, "scale: 0.6", False), (100.0, "scale: 0.01", True), (0.8, "scale: 1", False)],
)
def test_a_study_warns_of_normalized_curves_after_scaling(
    tmp_path: Path, top: float, scale: str, normalized: bool
) -> None:
    qe_file(tmp_path, top)
    (tmp_path / "tiny.yaml").write_text(STUDY.replace("SCALE", scale).replace("QUANTITY", "qe"))
    study = load_study(tmp_path / "tiny.yaml")
    assert study.warnings == ((f"qe.csv: {NORMALIZED}",) if normalized else ())


def test_a_transmission_of_one_is_no_relative_response(tmp_path: Path) -> None:
    qe_file(tmp_path, 1.0)
    text = (
        STUDY.replace("SCALE", "relative_to: C")
        .replace("QUANTITY", "transmission")
        .replace("{files", "{builtin: ar0820, files")
    )
    (tmp_path / "tiny.yaml").write_text(text)
    assert load_study(tmp_path / "tiny.yaml").warnings == ()
