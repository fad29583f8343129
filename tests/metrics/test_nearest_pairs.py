"""Distances of lamps of any brightness, of which hundreds of pairs are near, against published scans."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sweep.camera.model import scene_model
from sweep.camera.setup import Setup
from sweep.metrics.evaluate import evaluate
from sweep.study import Study, load_study

STUDIES = Path(__file__).parents[2] / "studies"
PUBLISHED = [
    ("hdr", "lamp intensity_cd=1000", "RYYCy", "chromatic_csd_green_red", 341_007.25),
    ("hdr", "lamp intensity_cd=177.827941004", "best stopband", "chromatic_dprime_yellow_red", 40.676),
    ("fog", "day visibility_m=500", "best stopband", "chromatic_csd_yellow_red", 2_890.30),
    ("fog", "day visibility_m=5000", "best stopband", "chromatic_csd_yellow_red", 5_887.28),
    ("fog", "day visibility_m=100", "best stopband", "chromatic_dprime_yellow_red", 6.038),
    ("exposure", "night exposure_s=2e-05", "best stopband", "chromatic_csd_yellow_red", 67.92),
    ("exposure", "night exposure_s=2e-05", "best stopband", "chromatic_dprime_yellow_red", 117.294),
]
"""Figures by independent scans, of the means over whole lamps."""


def mean_study(name: str, folder: Path) -> Study:
    """A study of the package in which lamps at one phase are read as the mean over the lamp."""
    text = (STUDIES / f"{name}.yaml").read_text().replace(", phase_px: any, readout: center", "")
    (folder / f"{name}.yaml").write_text(text)
    return load_study(folder / f"{name}.yaml")


def scene_of(study: Study, scenario: str, design: str) -> tuple[Setup, np.ndarray]:
    space = next(space for space in study.spaces if space.name == design)
    return study.setup(space, scenario), space.curves(space.points(0, 1), study.grid.size)


@pytest.mark.parametrize(("name", "scenario", "design", "column", "expected"), PUBLISHED)
def test_the_nearest_of_hundreds_of_near_pairs_is_found(
    name: str, scenario: str, design: str, column: str, expected: float, tmp_path: Path
) -> None:
    study = mean_study(name, tmp_path)
    setup, curves = scene_of(study, scenario, design)
    assert evaluate(scene_model(setup), curves, study.states)[column][0] == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize(
    ("name", "scenario", "design"),
    [("fog", "day visibility_m=150", "RGGB"), ("exposure", "night exposure_s=0.002", "best stopband")],
)
def test_no_bound_stands_in_a_column_of_errors(name: str, scenario: str, design: str, tmp_path: Path) -> None:
    """Whole lamps of which few pixels are full: none of 768,000 simulated discs was taken for the other color."""
    study = mean_study(name, tmp_path)
    setup, curves = scene_of(study, scenario, design)
    found = evaluate(scene_model(setup), curves, study.states)
    for column in ("error_yellow_red", "state_error", "chromatic_error_yellow_red"):
        assert found[column][0] < 1e-9
