"""Lights and sensors beyond what an eye sees, and spectra of any power."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

from sweep.spectra.color import chromaticity
from sweep.spectra.spectrum import WavelengthGrid
from sweep.study import load_study

from ..build import one_line
from ..golden import numbers_of

QE = "wavelength_nm,a,b\n300,0.5,0.1\n1200,0.5,0.6\n"


def study_of(tmp_path: Path, leds: str, more: str = "") -> Path:
    (tmp_path / "qe.csv").write_text(QE)
    (tmp_path / "led.csv").write_text(leds)
    (tmp_path / "a.yaml").write_text(
        "study: a\nsensor: {files: [{file: qe.csv, columns: {A: a, B: b}}]}\n"
        "lights: {files: [{file: led.csv, quantity: photons, outside: zero, signals: {one: [x], two: [y]}}]}\n"
        "wavelengths: {start_nm: 850, stop_nm: 1000, step_nm: 5}\ncfas: [AABB]\nobjective: csd_one_two\n" + more
    )
    return tmp_path / "a.yaml"


INFRARED = "wavelength_nm,x,y\n800,0,0\n880,1,0\n940,0,1\n1000,0,0\n"


@pytest.mark.parametrize(
    ("scene", "said"),
    [
        ("intensity_cd: 200", "a light that the eye does not see has no luminous intensity: led:x (got 200"),
        ("background_cd_m2: 3", "a background on wavelengths that the eye does not see has no luminance (got 3"),
    ],
)
def test_candelas_of_infrared_are_one_line(tmp_path: Path, scene: str, said: str) -> None:
    path = study_of(tmp_path, INFRARED, f"scenarios: {{a: {{{scene}, exposure: {{kind: fixed, exposure_s: 0.01}}}}}}\n")
    with one_line(said, "allowed: photons between 360 and 830 nm"):
        load_study(path)


def test_infrared_lights_are_computed(tmp_path: Path) -> None:
    study = load_study(study_of(tmp_path, INFRARED))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        numbers = numbers_of(study).set_index("column")["value"]
        assert numbers["csd_one_two"] > 0
    mixed = WavelengthGrid(start_nm=600, stop_nm=900, step_nm=1)
    with np.errstate(invalid="ignore"):
        assert np.isnan(chromaticity(mixed, np.eye(mixed.size)[[290]])).all()


def test_lights_of_any_sensible_power_are_the_same_lights(tmp_path: Path) -> None:
    rows = [(850, 0.0, 1.0), (900, 3.0, 2.0), (1000, 1.0, 0.0)]
    found = []
    for scale in (1e-99, 1.0, 1e99):
        leds = "wavelength_nm,x,y\n" + "".join(f"{w},{x * scale!r},{y * scale!r}\n" for w, x, y in rows)
        found.append(load_study(study_of(tmp_path, leds)).lights.photons)
    np.testing.assert_allclose(found[0], found[1], rtol=1e-12)
    np.testing.assert_allclose(found[2], found[1], rtol=1e-12)
