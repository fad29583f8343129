"""Curves whose largest value is 1: a relative response, which is said wherever it is taken for a QE."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sweep.spectra.facts import EACH_NORMALIZED, NORMALIZED, facts_of, notes
from sweep.spectra.formats import scan_curves
from sweep.study import load_study

from ..curve_texts import csv

NM = np.arange(390.0, 711, 5)
STUDY = """\
study: tiny
sensor: {files: [{file: qe.csv, columns: {R: R, G: G, B: B}, quantity: KEYS}]}
lights: tl16
cfas: [RGGB]
"""


@pytest.mark.parametrize(
    ("top", "keys", "normalized"),
    [
        (1.0, "qe, scale: 1", True),
        (1.0, "qe, scale: 0.6", False),
        (100.0, "qe, scale: 0.01", True),
        (0.999, "qe, scale: 1", False),
        (1.0, "transmission, relative_to: C", False),
    ],
)
def test_a_study_warns_of_normalized_curves_after_scaling(
    tmp_path: Path, top: float, keys: str, normalized: bool
) -> None:
    curves = [top * (1 - 1e-9) * np.exp(-(((NM - nm) / 80) ** 2)) for nm in (610, 540, 460)]
    qe = csv(tmp_path, "wavelength_nm,R,G,B", NM, *curves, name="qe.csv")
    if keys == "qe, scale: 1":
        assert (NORMALIZED in notes(facts_of(scan_curves(qe)), as_qe=True)) == normalized
    text = STUDY.replace("KEYS", keys)
    (tmp_path / "tiny.yaml").write_text(
        text.replace("{files", "{builtin: ar0820, files") if "relative" in keys else text
    )
    study = load_study(tmp_path / "tiny.yaml")
    said = [NORMALIZED] * normalized + [EACH_NORMALIZED] * ("qe" in keys)
    assert list(study.warnings) == [f"qe.csv: {note}" for note in said]
