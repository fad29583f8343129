"""By what filters work, in study files: what it becomes, its faults, and that a run keeps it."""

from __future__ import annotations

from pathlib import Path

import pytest

from sweep.designs.technology import Interference, Technology
from sweep.run.provenance import resolved_yaml

from ..build import BASE, faults, load

LAYERS = "technology: {interference: {effective_index: 1.8}}"
SENSOR = "sensor: {builtin: ar0820, technology: {G: pigment, R: {interference: {effective_index: 1.6}}}}"
STATED = (
    BASE.replace("to: G, at:", f"to: G, {LAYERS}, at:")
    .replace("    to: G\n", "    to: G\n    technology: pigment\n")
    .replace("sensor: ar0820", SENSOR)
)


def test_each_channel_has_the_technology_of_its_curve(tmp_path: Path) -> None:
    study = load(tmp_path, STATED)
    layers, red = (Technology(interference=Interference(effective_index=n)) for n in (1.8, 1.6))
    found = {space.name: study.view(space, "chart") for space in study.spaces}
    of = {name: dict(zip(view.mosaic.channels, view.technologies, strict=True)) for name, view in found.items()}
    assert of["RGGB"] == {"R": red, "G": Technology(), "B": None}
    assert of["mine"] == {"R": red, "Y": None, "N": layers, "Cy": None}
    assert of["edges"]["N"] == Technology()
    plain = load(tmp_path, BASE)
    assert {plain.view(space, "chart").technologies for space in plain.spaces} == {()}


def test_a_run_keeps_what_is_stated(tmp_path: Path) -> None:
    study = load(tmp_path, STATED)
    again = load(tmp_path, resolved_yaml(study))
    assert again.section == study.section
    assert resolved_yaml(again) == resolved_yaml(study)


WORDS = "a technology is `pigment`, or `interference: {effective_index: 1.8}`"


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("to: G, at:", "to: G, technology: dye, at:", f"tiny.yaml:6: designs.mine.technology: {WORDS}"),
        ("to: G, at:", "to: G, technology: interference, at:", f"tiny.yaml:6: designs.mine.technology: {WORDS}"),
        (
            "to: G, at:",
            "to: G, technology: {interference: {effective_index: 0.9}}, at:",
            "tiny.yaml:6: designs.mine.technology.interference.effective_index: not allowed (got 0.9)",
        ),
        (
            "to: G, at:",
            "to: G, technology: {interference: {index: 2}}, at:",
            "tiny.yaml:6: designs.mine.technology.interference.index: unknown key; allowed: effective_index",
        ),
        (
            "to: G, at:",
            f"to: C, {LAYERS}, at:",
            "tiny.yaml:6: designs.mine.technology: an interference filter lets through a share of its base "
            "(got 'filters that exceed Y'); allowed: a filter below it, or pigment",
        ),
        (
            "sensor: ar0820",
            f"sensor: {{builtin: ar0820, technology: {{Y: {LAYERS[12:]}}}}}",
            "tiny.yaml:6: designs.mine.base: the base curve Y is an interference filter itself (got 'Y')",
        ),
        (
            "sensor: ar0820",
            "sensor: {builtin: ar0820, technology: {Yy: pigment}}",
            "tiny.yaml:2: sensor.technology.Yy: unknown curve (got 'Yy'); allowed:",
        ),
        (
            "to: G, at:",
            "to: G, technology: pigment, at:",
            "tiny.yaml:6: designs.mine.technology: a pigment has no films that come out too thick "
            "(`production.thickness`) (got 'pigment'); allowed: interference, or nothing stated",
        ),
        (
            "to: G, at:",
            f"to: G, {LAYERS}, at:",
            "tiny.yaml:22: scenarios.chart.optics: the steepest ray grazes a filter whose technology is interference "
            "(got '98.7 degrees'); allowed: at most 85 degrees from f_number and cra_deg together",
        ),
    ],
)
def test_what_does_not_fit_is_a_fault(tmp_path: Path, old: str, new: str, expected: str) -> None:
    text = BASE.replace(old, new, 1)
    if "grazes" in expected:
        text += "scenarios: {chart: {optics: {f_number: 0.8, cra_deg: 60}}}\n"
    if "too thick" in expected:
        text += "production: {thickness: 0.01}\n"
    assert any(fault.startswith(expected) for fault in faults(tmp_path, text)), faults(tmp_path, text)


@pytest.mark.parametrize(
    ("scene", "expected"),
    [
        ("{field: {places: 3}}", "tiny.yaml:22: scenarios.a.field: a field has either `cra_max_deg` or a list"),
        ("{field: {cra_max_deg: 9, cra_deg: [0, 9]}}", "tiny.yaml:22: scenarios.a.field: a field has either"),
        ("{field: {cra_deg: [0, 9], places: 2}}", "tiny.yaml:22: scenarios.a.field: `places` goes with `cra_max_deg`"),
        ("{field: {cra_max_deg: 70}}", "tiny.yaml:22: scenarios.a.field.cra_max_deg: not allowed (got 70)"),
        (
            "{field: {cra_max_deg: 9}, optics: {cra_deg: 3}}",
            "tiny.yaml:22: scenarios.a: `field` says the chief ray angle of each place: leave out optics.cra_deg",
        ),
        (
            "{field: {cra_max_deg: 9}, target: {distance_m: 99, fov_deg: 60, phase_px: any}}",
            "tiny.yaml:22: scenarios.a: `field` needs a light at a named place of the mosaic",
        ),
    ],
)
def test_a_field_says_one_profile(tmp_path: Path, scene: str, expected: str) -> None:
    assert any(fault.startswith(expected) for fault in faults(tmp_path, BASE + f"scenarios: {{a: {scene}}}\n"))


def test_a_field_grows_linearly_or_as_listed(tmp_path: Path) -> None:
    scenes = "scenarios: {a: {field: {cra_max_deg: 30, places: 4}}, b: {field: {cra_deg: [0, 18, 20]}}}\n"
    study = load(tmp_path, BASE + scenes)
    fields = {name: scenario.field for name, scenario in study.scenarios.items()}
    assert {name: field and field.angles_deg for name, field in fields.items()} == {
        "a": (0.0, 10.0, 20.0, 30.0),
        "b": (0.0, 18.0, 20.0),
    }
    assert load(tmp_path, resolved_yaml(study)).section == study.section
