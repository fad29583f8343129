"""What the light of a CFA is a share of: a clear sensor's, or that of the brightest pixels where none is clear."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sweep.camera.sensor import make_sensor

from ..build import output_of
from ..curve_texts import csv

NM = np.arange(390.0, 711, 5)
CURVES = {name: 0.5 * np.exp(-(((NM - nm) / 40) ** 2)) for name, nm in (("R", 610), ("G", 540), ("B", 460))}
STUDY = """\
study: tiny
sensor: {files: [{file: qe.csv, columns: {R: R, G: G, B: B}}]MORE}
lights: tl16
cfas: [RGGB, BGGR]
"""


def test_a_run_names_the_sensitivity_reference(tmp_path: Path) -> None:
    outputs = []
    for name, more in (("alone", ""), ("stated", ", clear: G")):
        (tmp_path / name).mkdir()
        csv(tmp_path / name, "wavelength_nm,R,G,B", NM, *CURVES.values(), name="qe.csv")
        outputs.append(output_of(tmp_path / name, STUDY.replace("MORE", more)))
    alone, stated = outputs
    assert (alone.provenance.sensor.reference, alone.provenance.sensor.has_clear) == ("G", False)
    assert (stated.provenance.sensor.reference, stated.provenance.sensor.has_clear) == ("G", True)
    assert "G pixels alone" in alone.columns["cfa_sensitivity"].meaning
    assert "G pixels alone" not in stated.columns["cfa_sensitivity"].meaning


@pytest.mark.parametrize(("name", "clear"), [("W", True), ("White", True), ("mono", True), ("Y", False)])
def test_a_pixel_is_clear_by_its_name(name: str, clear: bool) -> None:
    sensor = make_sensor("mine", {**CURVES, name: np.full(NM.size, 0.6)}, "call")
    assert (sensor.clear, sensor.has_clear, sensor.brightest) == (name, clear, "" if clear else name)
