"""Faults of several sections are all told at the first try, and none that follows from another."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from sweep.base.errors import StudyError

from ..build import load

STUDY = """\
study: tiny
seed: 1
sensor: ar0820
lights: tl16
wavelengths: {start_nm: 400, stop_nm: 700, step_nm: 1}
tolerance_dn: 0.1
pixel: {pitch_um: 2.1, bits: 12, well_e: 10000}
scenarios:
  chart: {exposure: {kind: white_patch, level: 0.5}, noise: true}
  far: {target: {distance_m: 100, fov_deg: 60}, optics: {f_number: 2}, noise: true}
cfas: [RGGB, RYNCy]
designs:
  mine: {cfa: RYNCy, channel: N, base: Y, to: G, at: {left_nm: 606, left_width_nm: 36, right_nm: 646, right_width_nm: 7}}
sweeps:
  edges:
    cfa: RYNCy
    channel: N
    base: Y
    to: G
    grid: {left_nm: [600, 610], left_width_nm: 5, right_nm: 650, right_width_nm: 6}
recognition: {states: [yellow, red], error_max: 0.001}
production: {edge_shift_nm: 2}
geometry: {urban: {distance_m: 100, fov_deg: 60}}
clouds: {RGGB: [R, G]}
objective: csd_yellow_red
constraints:
  sensitivity: {min: 0.9}
search:
  space: edges
  scenario: chart
  algorithm: SLSQP
  starts: 4
"""
MISTAKES = {
    "study": ("study: tiny\n", "study: [tiny]\n"),
    "seed": ("seed: 1", "seed: -1"),
    "sensor": ("sensor: ar0820", "sensor: ar0280"),
    "sensor.builtin": ("sensor: ar0820", "sensor: {builtin: 3}"),
    "lights": ("lights: tl16", "lights: tl61"),
    "wavelengths.step_nm": ("step_nm: 1}", "step_nm: 0}"),
    "tolerance_dn": ("tolerance_dn: 0.1", "tolerance_dn: -1"),
    "pixel.pitch_um": ("pitch_um: 2.1", "pitch_um: x"),
    "pixel.bitz": ("bits: 12", "bitz: 12"),
    "pixel.well_e": ("well_e: 10000", "well_e: -3"),
    "scenarios.chart.exposure.level": ("level: 0.5", "level: 50"),
    "scenarios.chart.exposure.kind": ("kind: white_patch", "kind: white_pach"),
    "scenarios.far.target.distance_m": ("distance_m: 100, fov_deg: 60}, op", "distance_m: -1, fov_deg: 60}, op"),
    "scenarios.far.optics.f_nmber": ("f_number: 2", "f_nmber: 2"),
    "scenarios.chart.noise": ("level: 0.5}, noise: true", "level: 0.5}"),
    "cfas.RGXB": ("[RGGB, RYNCy]", "[RGGB, RYNCy, RGXB]"),
    "cfas.RGB": ("[RGGB, RYNCy]", "[RGGB, RYNCy, RGB]"),
    "designs.mine.channel": ("mine: {cfa: RYNCy, channel: N", "mine: {cfa: RYNCy, channel: NN"),
    "designs.mine.to": ("to: G, at", "to: Gg, at"),
    "designs.mine.at.right_wdth_nm": ("right_width_nm: 7", "right_wdth_nm: 7"),
    "sweeps.edges.cfa": ("    cfa: RYNCy\n", "    cfa: RYNX\n"),
    "sweeps.edges.bse": ("    base: Y\n", "    bse: Y\n"),
    "sweeps.edges.base": ("    base: Y\n", "    base: Yy\n"),
    "sweeps.edges.grid.left_width_nm": ("left_width_nm: 5", "left_width_nm: -5"),
    "sweeps.edges.grid.right_nm": ("right_nm: 650", "right_nm: x"),
    "recognition.states": ("[yellow, red], error", "[yelow, red], error"),
    "recognition.error_max": ("error_max: 0.001", "error_max: 2"),
    "production.edge_shift_nm": ("edge_shift_nm: 2", "edge_shift_nm: -2"),
    "geometry.urban.distance_m": ("urban: {distance_m: 100", "urban: {distance_m: 0"),
    "clouds.RGGB[1]": ("[R, G]", "[R, X]"),
    "objective": ("objective: csd_yellow_red", "objective: csd_yelow_red"),
    "constraints.sensitivty": ("sensitivity: {min", "sensitivty: {min"),
    "constraints.sensitivity.min": ("{min: 0.9}", "{min: 90}"),
    "search.space": ("space: edges", "space: edgs"),
    "search.scenario": ("scenario: chart", "scenario: dusk"),
    "search.algorithm": ("algorithm: SLSQP", "algorithm: SLSQ"),
    "search.starts": ("starts: 4", "starts: 0"),
    "fooo": ("geometry:", "fooo: 1\ngeometry:"),
}
"""Key of a fault -> what makes it."""
NO_CURVES = {"sensor", "sensor.builtin", "wavelengths.step_nm"}
NEEDS = {
    "cfas.RGXB": {*NO_CURVES, "designs.mine.channel", "sweeps.edges.cfa"},
    "cfas.RGB": NO_CURVES - {"sensor"},
    "designs.mine.channel": NO_CURVES,
    "designs.mine.to": NO_CURVES,
    "designs.mine.at.right_wdth_nm": {*NO_CURVES, "designs.mine.channel", "designs.mine.to"},
    "sweeps.edges.base": {*NO_CURVES, "sweeps.edges.grid.right_nm"},
    "sweeps.edges.grid.left_width_nm": {
        *NO_CURVES, "sweeps.edges.grid.right_nm", "sweeps.edges.bse", "sweeps.edges.base", "sweeps.edges.cfa"
    },
    "scenarios.chart.exposure.level": {"scenarios.chart.exposure.kind"},
    "recognition.states": {"lights"},
    "objective": {"lights"},
    "constraints.sensitivty": {"lights"},
    "constraints.sensitivity.min": {"lights", "constraints.sensitivty"},
}  # fmt: skip
"""Fault -> those beside which it cannot be seen yet, since its check needs these keys."""


def shown(folder: Path, text: str) -> list[str]:
    with pytest.raises(StudyError) as caught:
        load(folder, text)
    issues = caught.value.issues
    assert all(issue.line is not None for issue in issues)
    assert [issue.line for issue in issues] == sorted(issue.line or 0 for issue in issues)
    return sorted(issue.key or "" for issue in issues)


@pytest.mark.parametrize("key", MISTAKES)
def test_a_mistake_alone_is_one_fault(tmp_path: Path, key: str) -> None:
    old, new = MISTAKES[key]
    assert old in STUDY
    assert shown(tmp_path, STUDY.replace(old, new, 1)) == [key]


@pytest.mark.parametrize("seed", range(40))
def test_three_to_six_mistakes_are_shown_at_once(tmp_path: Path, seed: int) -> None:
    rng, text, made = random.Random(seed), STUDY, list[str]()
    for key in rng.sample(list(MISTAKES), rng.randint(3, 6)):
        old, new = MISTAKES[key]
        if old in text:
            text = text.replace(old, new, 1)
            made.append(key)
    hidden = {key for key in made if NEEDS.get(key, set()) & {*made}}
    assert shown(tmp_path, text) == sorted({*made} - hidden)
