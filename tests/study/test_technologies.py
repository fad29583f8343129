"""By what filters work, in study files: what it becomes, its faults, and that a run keeps it."""

from __future__ import annotations

from pathlib import Path

import pytest

from sweep.designs.technology import Interference, Technology
from sweep.results.identity import fingerprint
from sweep.runs.provenance import resolved_yaml

from ..build import BASE, load, one_line

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
    of = {}
    for space in study.spaces:
        camera = study.setup(space, "chart").camera
        of[space.name] = dict(zip(camera.mosaic.channels, camera.technologies, strict=True))
    assert of["RGGB"] == {"R": red, "G": Technology(), "B": None}
    assert of["mine"] == {"R": red, "Y": None, "N": layers, "Cy": None}
    assert of["edges"]["N"] == Technology()


def test_a_resolved_study_is_a_study_with_the_same_rows(tmp_path: Path) -> None:
    study = load(tmp_path, STATED)
    again = load(tmp_path, resolved_yaml(study))
    assert again.section == study.section
    assert fingerprint(again) == fingerprint(study)
    assert resolved_yaml(again) == resolved_yaml(study)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("to: G, at:", "to: G, technology: dye, at:", "6: designs.mine.technology: a technology is `pigment`, or"),
        (
            "to: G, at:",
            "to: G, technology: {interference: {effective_index: 0.9}}, at:",
            "6: designs.mine.technology.interference.effective_index: not allowed (got 0.9)",
        ),
        (
            "to: G, at:",
            f"to: C, {LAYERS}, at:",
            "6: designs.mine.technology: an interference filter lets through a share",
        ),
        (
            "sensor: ar0820",
            f"sensor: {{builtin: ar0820, technology: {{Y: {LAYERS[12:]}}}}}",
            "6: designs.mine.base: the base curve Y is an interference filter itself",
        ),
        (
            "sensor: ar0820",
            "sensor: {builtin: ar0820, technology: {Yy: pigment}}",
            "2: sensor.technology.Yy: unknown curve",
        ),
        (
            "to: G, at:",
            "to: G, technology: pigment, at:",
            "6: designs.mine.technology: a pigment has no films that come out too thick",
        ),
        (
            "to: G, at:",
            f"to: G, {LAYERS}, at:",
            "22: scenarios.chart.optics: the steepest ray grazes a filter",
        ),
    ],
)
def test_inconsistent_technologies_are_refused(tmp_path: Path, old: str, new: str, expected: str) -> None:
    text = BASE.replace(old, new, 1)
    if "grazes" in expected:
        text += "scenarios: {chart: {optics: {f_number: 0.8, cra_deg: 60}}}\n"
    if "too thick" in expected:
        text += "production: {thickness: 0.01}\n"
    with one_line(expected, alone=False):
        load(tmp_path, text)


@pytest.mark.parametrize(
    ("scene", "expected"),
    [
        ("{field: {places: 3}}", "field: a field has either `cra_max_deg`, a list"),
        ("{field: {cra_max_deg: 9, cra_deg: [0, 9]}}", "field: a field has either"),
        ("{field: {cra_max_deg: 9, corner_mm: 4}}", "field: `corner_mm` goes with `profile: FI"),
        ("{field: {cra_max_deg: 9, places: 1}}", "field.places: field positions are `any`"),
        ("{field: {cra_max_deg: 9, heights: [0, 1]}}", "field: `heights` are those of a list"),
        ("{field: {cra_deg: [0, 9], heights: [0, 0.9]}}", "field: `heights` grow from 0"),
        ("{field: {cra_max_deg: 70}}", "field.cra_max_deg: not allowed (got 70)"),
        ("{field: {cra_max_deg: 9}, optics: {cra_deg: 3}}", "leave out optics.cra_deg"),
        (
            "{field: {cra_max_deg: 9}, target: {distance_m: 99, fov_deg: 60, phase_px: any}}",
            "`field` needs a named sampling phase",
        ),
    ],
)
def test_a_field_says_one_profile(tmp_path: Path, scene: str, expected: str) -> None:
    with one_line("tiny.yaml:22: scenarios.a", expected, alone=False):
        load(tmp_path, BASE + f"scenarios: {{a: {scene}}}\n")


def test_a_field_grows_linearly_or_as_listed(tmp_path: Path) -> None:
    scenes = "scenarios: {a: {field: {cra_max_deg: 30, places: 4}}, b: {field: {cra_deg: [0, 18, 20]}}, "
    scenes += "c: {field: {cra_deg: [0, 18, 20], places: 5}}, d: {field: {cra_deg: [0, 8, 9], heights: [0, 0.8, 1]}}}\n"
    study = load(tmp_path, BASE + scenes)
    fields = {name: scenario.field for name, scenario in study.scenarios.items()}
    assert {name: field and tuple(map(field.cra_at, field.counted_heights)) for name, field in fields.items()} == {
        "a": (0.0, 10.0, 20.0, 30.0),
        "b": (0.0, 18.0, 20.0),
        "c": (0.0, 9.0, 18.0, 19.0, 20.0),
        "d": (0.0, 8.0, 9.0),
    }
    assert load(tmp_path, resolved_yaml(study)).section == study.section


LENS = "Image height (mm);CRA (deg)\n0;0\n1,5;9\n3;15,5\n4;14\n"


def test_a_lens_file_says_the_chief_ray_angles(tmp_path: Path) -> None:
    """Rows in mm, decimal commas, a corner between two rows; a resolved study holds the rows, and needs no file."""
    (tmp_path / "lens.csv").write_text(LENS)
    text = (
        "scenarios: {a: {field: {profile: lens.csv, places: any}}, b: {field: {profile: lens.csv, corner_mm: 3.5}}}\n"
    )
    study = load(tmp_path, BASE + text)
    fields = [scenario.field for scenario in study.scenarios.values()]
    assert [field and field.knots for field in fields] == [
        ((0.0, 0.375, 0.75, 1.0), (0.0, 9.0, 15.5, 14.0)),
        ((0.0, 1.5 / 3.5, 3 / 3.5, 1.0), (0.0, 9.0, 15.5, 14.75)),
    ]
    assert [field and field.places for field in fields] == ["any", 9]
    assert any("the last row, 4 mm, was taken for the corner" in warning for warning in study.warnings)
    assert list(study.digests) == ["lens.csv"]
    (tmp_path / "lens.csv").unlink()
    assert load(tmp_path, resolved_yaml(study)).section == study.section


@pytest.mark.parametrize(
    ("table", "expected"),
    [
        ("", "lens.csv: the file is empty"),
        ("h,cra\n0,0\n1,9\n", "lens.csv:1: h: the first column does not say the unit"),
        ("h_mm,cra,x\n0,0\n", "lens.csv:2: wrong number of columns"),
        ("h_mm,distortion\n0,0\n1,2\n", "lens.csv:1: which column has chief ray angles?"),
        ("h_mm,cra_rad\n0,0\n1,0.3\n", "lens.csv:1: cra_rad: chief ray angles are in radians"),
        ("h_mm,cra\n0,0\n1,-9\n", "lens.csv:3: cra: negative value"),
        ("h_mm,cra\n0,0\n1,nan\n", "lens.csv:3: cra: not a usable number"),
        ("h_mm,cra\n0,0\n2,9\n1,8\n", "lens.csv:4: height_mm: image heights are not sorted"),
        ("h_mm,cra\n0.5,0\n1,9\n", "lens.csv:2: height_mm: image heights begin in the middle"),
        ("h_mm,cra\n0,0\n1,61\n", "lens.csv:3: cra: too steep a chief ray"),
        ("height (%),cra\n0,0\n90,9\n", "lens.csv:3: height_percent: the last row is not the corner"),
        ("rel. height,cra\n0,0\n1,9\n", "lens.csv:1: height_relative: `corner_mm` needs heights in mm"),
        ("h_mm,cra\n0,0\n1,8\n", "lens.csv:3: height_mm: the table ends before the corner"),
    ],
)
def test_a_bad_lens_file_is_one_line(tmp_path: Path, table: str, expected: str) -> None:
    (tmp_path / "lens.csv").write_text(table)
    corner = ", corner_mm: 3" if "corner_mm" in expected or "before the corner" in expected else ""
    with one_line(expected):
        load(tmp_path, BASE + f"scenarios: {{a: {{field: {{profile: lens.csv{corner}}}}}}}\n")
