"""Scenes in study files: what they become, and their faults."""

from __future__ import annotations

from pathlib import Path

import pytest

from ..build import BASE, load, one_line


@pytest.mark.parametrize(
    ("scene", "expected"),
    [
        ("far: {visibility_m: 100}", "tiny.yaml:5: scenarios.far: visibility_m needs a target with a distance"),
        ("far: {target: {distance_m: 100, fov_deg: 60, phase_px: all}}", "tiny.yaml:5: scenarios.far.target.phase_px"),
        (
            "far: {each: [1]}",
            "tiny.yaml:5: scenarios.far.each: no mapping of keys (got [1]); allowed: {target.distance_m: [20, 50]}",
        ),
        (
            "a: {target: {distance_m: 1, fov_deg: 60}}",
            "tiny.yaml:5: scenarios.a.target: the light is too large (got '730.956 px'); allowed: at most 128 px",
        ),
        (
            "a: {target: {distance_m: 90, fov_deg: 60}, optics: {focus_m: 0.005}}",
            "tiny.yaml:5: scenarios.a.optics.focus_m: too near for this lens (got '0.005 m'); allowed: more than 0.0154 m",
        ),
        (
            "a: {target: {distance_m: 90, fov_deg: 60}, optics: {f_number: 0.01}}",
            "tiny.yaml:5: scenarios.a.optics.f_number: the image is too fine",
        ),
        (
            "a: {each: {off_axis_deg: [1, 2, 1]}}",
            "tiny.yaml:5: scenarios.a: two scenarios have one name (got 'a off_axis_deg=1'); allowed: other names",
        ),
        (
            "a: {each: {off_axis_deg: [mean]}}",
            "tiny.yaml:5: scenarios.a.each.off_axis_deg: not a number (got 'mean')",
        ),
        (
            "a: {intensity_cd: 200}",
            "tiny.yaml:5: scenarios.a: intensity_cd needs a fixed exposure: the white patch is given in photons",
        ),
        (
            "far: {drive: {duty: 0.5, frequency_hz: 90}}",
            "search.scenario: a search under a pulsed light needs a fixed exposure (got 'far')",
        ),
        (
            "night: {exposure: {kind: fixd, exposure_s: 1}}",
            "tiny.yaml:5: scenarios.night.exposure.kind: unknown kind (got 'fixd')",
        ),
        (
            "night: {exposure: {kind: fixed, exposure_ms: 1, exposure_s: 1}}",
            "tiny.yaml:5: scenarios.night.exposure.exposure_ms: unknown key",
        ),
    ],
)
def test_a_fault_of_a_scene_is_one_line(tmp_path: Path, scene: str, expected: str) -> None:
    with one_line(expected):
        load(tmp_path, BASE.replace("lights: tl16\n", f"lights: tl16\nscenarios:\n  {scene}\n"))
