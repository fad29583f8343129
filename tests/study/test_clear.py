"""What the light of a CFA is a share of: a clear sensor's, or that of the brightest pixels where none is clear."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import sweep
from sweep.camera.sensor import make_sensor
from sweep.report.compare_tables import curve_notes
from sweep.report.sections.trade_off import TradeOff
from sweep.results.output import Output, read_output

from ..build import load, ran, sentences_of
from ..commanded import commanded
from ..curve_texts import csv

NM = np.arange(390.0, 711, 5)
CURVES = {name: 0.5 * np.exp(-(((NM - nm) / 40) ** 2)) for name, nm in (("R", 610), ("G", 540), ("B", 460))}
STUDY = """\
study: tiny
sensor: {files: [{file: qe.csv, columns: {R: R, G: G, B: B}}]MORE}
lights: tl16
cfas: [RGGB, BGGR, RGNB]
designs:
  mine: {cfa: RGNB, channel: N, base: G, to: 0.1, at: {left_nm: 580, left_width_nm: 9, right_nm: 600, right_width_nm: 9}}
"""


def qe_file(folder: Path) -> Path:
    return csv(folder, "wavelength_nm,R,G,B", NM, *CURVES.values(), name="qe.csv")


def output_of(folder: Path, more: str = "") -> Output:
    folder.mkdir()
    qe_file(folder)
    ran(load(folder, STUDY.replace("MORE", more)), folder / "out", 1)
    return read_output(folder / "out")


def texts_of(output: Output) -> list[str]:
    """Texts that say what the light is a share of."""
    (trade_off,) = TradeOff.of(output)
    assert trade_off.picture is not None
    return [sentences_of(output)[1], trade_off.picture.panels[-1].x_label, output.columns["cfa_sensitivity"].meaning]  # type: ignore[attr-defined]


def test_every_text_names_the_sensitivity_reference(tmp_path: Path) -> None:
    alone, stated = output_of(tmp_path / "alone"), output_of(tmp_path / "stated", ", clear: G")
    assert (alone.provenance.sensor.reference, alone.provenance.sensor.has_clear) == ("G", False)
    assert (stated.provenance.sensor.reference, stated.provenance.sensor.has_clear) == ("G", True)
    for text in texts_of(alone):
        assert "G pixels alone" in text
        assert "clear" not in text
        assert "color filters" not in text
    for text in texts_of(stated):
        assert "a sensor without" in text
    (note,) = curve_notes({"one": alone, "two": stated})
    assert "shares of the light of G pixels alone in one, of a clear sensor's light in two." in note


@pytest.mark.parametrize(("name", "clear"), [("W", True), ("White", True), ("mono", True), ("Y", False)])
def test_a_pixel_is_clear_by_its_name(name: str, clear: bool) -> None:
    sensor = make_sensor("mine", {**CURVES, name: np.full(NM.size, 0.6)}, "call")
    assert (sensor.clear, sensor.has_clear, sensor.brightest) == (name, clear, "" if clear else name)


def test_an_evaluation_names_the_sensitivity_reference(tmp_path: Path) -> None:
    qe, own = qe_file(tmp_path), tmp_path / "own.csv"
    own.write_text("wavelength_nm,N\n390,0.1\n540,0.3\n710,0.1\n")
    code, out, err = commanded("evaluate", own, "--sensor", qe, "--relative-to", "G")
    assert code == 0, err
    assert "Light: 1 = a sensor of G pixels alone, its brightest curve." in out
    assert "Light: 1" not in str(sweep.evaluate(own, relative_to="Y"))
    of_run = sweep.evaluate(output_of(tmp_path / "run").folder, design="mine")
    assert "Light: 1 = a sensor of G pixels alone, its brightest curve." in str(of_run)
