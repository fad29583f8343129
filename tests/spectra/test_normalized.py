"""Curves whose largest value is 1: a relative response, which is said wherever it is taken for a QE."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sweep.api.new import new_study
from sweep.report.describe import describe
from sweep.spectra.facts import NORMALIZED
from sweep.study import load_study

from ..curve_texts import csv

NM = np.arange(390.0, 711, 5)
STUDY = """\
study: tiny
sensor: {files: [{file: qe.csv, columns: {R: R, G: G, B: B}, quantity: KEYS}]}
lights: tl16
cfas: [RGGB]
"""


def qe_file(folder: Path, top: float) -> Path:
    curves = [top * (1 - 1e-9) * np.exp(-(((NM - nm) / 80) ** 2)) for nm in (610, 540, 460)]
    return csv(folder, "wavelength_nm,R,G,B", NM, *curves, name="qe.csv")


@pytest.mark.parametrize(("top", "normalized"), [(1.0, True), (0.8, False), (0.999, False)])
def test_a_file_with_a_maximum_of_one_gets_a_note_on_normalization(
    tmp_path: Path, top: float, normalized: bool
) -> None:
    qe = qe_file(tmp_path, top)
    assert (f"Note: {NORMALIZED}." in describe(qe, output=tmp_path).lines) == normalized
    assert (f"Note: qe.csv: {NORMALIZED}." in new_study("mine", folder=tmp_path, qe=[qe]).lines) == normalized


@pytest.mark.parametrize(
    ("top", "keys", "normalized"),
    [
        (1.0, "qe, scale: 1", True),
        (1.0, "qe, scale: 0.6", False),
        (100.0, "qe, scale: 0.01", True),
        (0.8, "qe, scale: 1", False),
        (1.0, "transmission, relative_to: C", False),
    ],
)
def test_a_study_warns_of_normalized_curves_after_scaling(
    tmp_path: Path, top: float, keys: str, normalized: bool
) -> None:
    qe_file(tmp_path, top)
    text = STUDY.replace("KEYS", keys)
    (tmp_path / "tiny.yaml").write_text(
        text.replace("{files", "{builtin: ar0820, files") if "relative" in keys else text
    )
    study = load_study(tmp_path / "tiny.yaml")
    assert study.warnings == ((f"qe.csv: {NORMALIZED}",) if normalized else ())
