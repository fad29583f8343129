"""Distances of many lamps of any brightness, of which hundreds of pairs are near, against scans of every brightness."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sweep.camera.model import scene_model
from sweep.camera.setup import Setup
from sweep.metrics.brightness import Walk, curves_of
from sweep.metrics.evaluate import evaluate
from sweep.metrics.separation import pixel_roots
from sweep.spectra.lights import Lights, class_pairs
from sweep.study import Study, load_study

from ..hard.scenes import scene
from .brightness_scan import smallest

STUDIES = Path(__file__).parents[2] / "studies"
_MOST_CASES = 2
PUBLISHED = [
    ("hdr", "lamp intensity_cd=1000", "RYYCy", "chromatic_csd_green_red", 341_007.25),
    ("hdr", "lamp intensity_cd=177.827941004", "best stopband", "chromatic_dprime_yellow_red", 40.05),
    ("fog", "day visibility_m=500", "best stopband", "chromatic_csd_yellow_red", 2_890.30),
    ("fog", "day visibility_m=5000", "best stopband", "chromatic_csd_yellow_red", 5_887.28),
    ("fog", "day visibility_m=100", "best stopband", "chromatic_dprime_yellow_red", 6.036),
    ("exposure", "night exposure_s=2e-05", "best stopband", "chromatic_csd_yellow_red", 67.92),
    ("exposure", "night exposure_s=2e-05", "best stopband", "chromatic_dprime_yellow_red", 115.7),
]
"""Figures by an independent scan, of the means over whole lamps."""


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
    assert found["error_bound_yellow_red"][0] > 1e-3


def assert_no_distance_is_above_a_scan(setup: Setup, curves: np.ndarray, seed: int, *, by_pixel: bool = True) -> None:
    """All pairs of types, in a few cases of the scene, in DN, by pixel, and in units of the noise."""
    cases = [*scene_model(setup.over_brightness).lamps(curves)]
    chosen = np.random.default_rng(seed).permutation(len(cases))[:_MOST_CASES]
    roots = pixel_roots(setup.camera.mosaic)
    kinds = [(1.0, False), *([(roots, False)] if by_pixel else []), *([(1.0, True)] if cases[0].noisy else [])]
    for factors, noise in kinds:
        some = [cases[at].times(np.ones(roots.size) * factors) for at in chosen]
        walked = curves_of(some, setup)
        for a, b in class_pairs(list(setup.members)):
            members = setup.members[a], setup.members[b]
            found = float(Walk.of(walked, len(some), *members, noise=noise).distances.min())
            expected = smallest(some, *members, noise=noise)
            assert found <= expected * (1 + 1e-3) + 1e-6, (a, b, noise, found, expected)
            assert found >= expected * (1 - 1e-2) - 1e-3, (a, b, noise, found, expected)


def many_lamps(lights: Lights, count: int, seed: int) -> Lights:
    """So many yellow and red lamps: those of a set, a few nm to either side."""
    rng, names, types, photons = np.random.default_rng(seed), list[str](), list[str](), []
    for kind in ("yellow", "red"):
        for number in range(count):
            own = lights.photons[rng.choice(lights.members[kind])]
            nodes = np.arange(own.size)
            moved = np.interp(nodes + rng.uniform(-1, 1), nodes, own)
            names.append(f"{kind} {number}")
            types.append(kind)
            photons.append(moved / moved.sum() * own.sum())
    return Lights("many", tuple(names), tuple(types), np.array(photons), lights.photon_ratio, "", True)


@pytest.mark.parametrize("captures", [{}, {"captures": "split_pixel"}])
def test_of_forty_lamps_a_type_none_is_nearer(captures: dict[str, str]) -> None:
    at = {"optics": {"f_number": 2}, "exposure": {"kind": "fixed", "exposure_s": 2e-3}, "intensity_cd": 900.0}
    made = scene("many", "RYNCy", at | {"noise": True}, {"offset_dn": 64, "read_noise_e": 2} | captures)
    setup = replace(made.setup, lights=many_lamps(made.setup.lights, 40, 3))
    assert_no_distance_is_above_a_scan(setup, made.curves, 1, by_pixel=False)


SHIPPED = ("exposure", "fog", "hdr", "hdr_filter", "night", "noise", "pixel", "distance")


@pytest.mark.slow
@pytest.mark.parametrize("name", SHIPPED)
def test_no_distance_of_the_shipped_studies_is_above_a_scan(name: str) -> None:
    study = load_study(STUDIES / f"{name}.yaml")
    rng = np.random.default_rng(len(name))
    designs = [space.name for space in study.spaces if space.kind in ("reference", "design")]
    setup, curves = scene_of(study, str(rng.choice(list(study.scenarios))), str(rng.choice(designs)))
    assert_no_distance_is_above_a_scan(setup, curves, int(rng.integers(100)))
