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
    assert any(fault.startswith(expected) for fault in faults(tmp_path, text)), faults(tmp_path, text)
