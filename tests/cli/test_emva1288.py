"""EMVA 1288 results become the figures of a pixel."""

from __future__ import annotations

from pathlib import Path

import pytest
from ruamel.yaml import YAML

from sweep.camera.pixel import Pixel
from sweep.study import load_study

from ..commanded import commanded

GIVEN = [
    ("sensitivity", "K", "0.280769280926", "$DN/e^-$"),
    ("sensitivity", "u_e_sat", "13972.6302563", "$e^-$"),
    ("sensitivity", "sigma_d", "10.8980275235", "$e^-$"),
    ("sensitivity", "QE", "45.1", "\\%"),
    ("spatial", "PRNU1288", "0.75", "\\%"),
    ("dark_current", "u_I_mean", "nan", "e/s"),
]


def written(folder: Path, given: list[tuple[str, str, str, str]]) -> Path:
    inner = "".join(
        f"<{part}><{name}><Short>x</Short><Value>{value}</Value><Unit>{unit}</Unit></{name}></{part}>"
        for part, name, value, unit in given
    )
    path = folder / "results.xml"
    path.write_text(f"<results>{inner}</results>")
    return path


def test_a_summary_is_a_pixel_of_a_study(tmp_path: Path) -> None:
    code, said, wrong = commanded("describe", written(tmp_path, GIVEN))
    assert code == 0, wrong
    _, line, absent = said.splitlines()
    pixel = Pixel(**YAML(typ="safe").load(line)["pixel"])
    assert (pixel.well_e, pixel.gain_dn_per_e, pixel.read_noise_e) == (13972.6302563, 0.280769280926, 10.8980275235)
    assert pixel.prnu == pytest.approx(0.0075, rel=1e-12)
    assert "dark_e_per_s, bits, offset_dn" in absent


def test_a_new_study_has_the_pixel(tmp_path: Path) -> None:
    file, folder = written(tmp_path, GIVEN), tmp_path / "studies"
    code, said, wrong = commanded("new", "mine", "--pixel", file, "--folder", folder)
    assert code == 0, wrong
    assert "Pixel: well_e, gain_dn_per_e, read_noise_e, prnu from" in said
    assert "not in it: dark_e_per_s, bits" in said
    text = (folder / "mine.yaml").read_text()
    assert "# EMVA 1288 results: results.xml" in text
    pixel = load_study(folder / "mine.yaml").pixel
    assert (pixel.well_e, pixel.gain_dn_per_e, pixel.bits) == (13972.6302563, 0.280769280926, Pixel().bits)
    assert pixel.prnu == pytest.approx(0.0075, rel=1e-12)
    (tmp_path / "curves.csv").write_text("wavelength_nm,R\n400,1\n700,1\n")
    code, _, wrong = commanded("new", "other", "--pixel", tmp_path / "curves.csv", "--folder", folder)
    assert (code, len(wrong.splitlines())) == (2, 1), wrong
    assert not (folder / "other.yaml").exists()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"K": ("0.28", "e^-/DN")}, "K: another unit (got 'e-/DN'); allowed: DN/e-"),
        ({"K": ("zero", "DN/e^-")}, "K: not a number (got 'zero')"),
        ({"PRNU1288": ("75", "\\%")}, "prnu: not a pixel's figure (got 0.75)"),
    ],
)
def test_invalid_pixel_is_one_line(tmp_path: Path, change: dict[str, tuple[str, str]], words: str) -> None:
    given = [(part, name, *change.get(name, (value, unit))) for part, name, value, unit in GIVEN]
    code, _, said = commanded("describe", written(tmp_path, given))
    assert (code, len(said.splitlines())) == (2, 1), said
    assert words in said


def test_other_xml_is_refused(tmp_path: Path) -> None:
    code, _, said = commanded("describe", written(tmp_path, [("sensitivity", "K", "1", "DN/e")][:0]))
    assert code == 2
    assert "not EMVA 1288 results" in said
