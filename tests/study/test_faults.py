"""Faults of a study: all of the schema, then all of meaning, each at its place and with what was meant."""

from __future__ import annotations

from pathlib import Path

import pytest

from sweep.base.errors import StudyError
from sweep.study import Study, load_study

from ..build import BASE, issues, load, one_line
from ..conftest import STUDIES
from ..watchdog import within

MEANING = BASE.replace("    cfa: RYNCy", "    cfa: RYNX").replace("sensitivity:", "sensitivty:")
HANG_S = 120.0
SENSOR_FILE = "sensor:\n  files:\n    - {file: qe.csv, columns: {R: R, C: C}}\n"
AXES = ", ".join(f"x{i}: {{min: 590, max: 610, count: 1000000}}" for i in range(50))
MANY = f"{{cfa: RGGB, channel: G, base: G, to: B, grid: {{{AXES}}}}}"
NOISY = "recognition: {}\nscenarios: {chart: {noise: true}}\n"


def lines(tmp_path: Path, text: str) -> list[str]:
    """The line and the key of each fault."""
    return ["".join(issue.split(":")[1:3]) for issue in issues(tmp_path, text)]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (MEANING + "foo: 1\n", ["22 foo"]),
        (MEANING.replace("study: tiny\n", "").replace("space: edges", "starts: 0"), ["1 study", "20 search.starts"]),
        (
            MEANING.replace("ar0820", "ar0280").replace("space: edges", "scenario: dusk"),
            ["2 sensor", "9 sweeps.edges.cfa", "19 constraints.sensitivty", "21 search.scenario"],
        ),
        (
            MEANING.replace("tl16", "tl61").replace("space: edges", "algorithm: SLSQ"),
            ["3 lights", "9 sweeps.edges.cfa", "21 search.algorithm"],
        ),
        (MEANING + "metrics: nothing.py:NAME\n", ["9 sweeps.edges.cfa", "22 metrics"]),
    ],
)
def test_schema_errors_are_reported_before_errors_of_meaning(tmp_path: Path, text: str, expected: list[str]) -> None:
    assert lines(tmp_path, text) == expected


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("search:\n", "validate: {leave_one_out: true}\nserach:\n", "21 serach"),
        ("search:\n", "validate: {leave_one_out: true}\nsearch:\n  starts: 0\n", "22 search.starts"),
        ("    base: Y\n", "    bse: Y\n", "11 sweeps.edges.bse"),
        ("cfas: [RGGB, RYNCy]", "cfas: {RGGB: 3, RYNCy: {}}", "4 cfas.RGGB"),
        ("sensor: ar0820", "sensor: {builtin: 3}", "2 sensor.builtin"),
        (
            "search:\n",
            "objective: worst_csd_yellow_red\nproduction: {edge_shift_nm: x}\nsearch:\n",
            "21 production.edge_shift_nm",
        ),
    ],
)
def test_no_fault_follows_from_another(tmp_path: Path, old: str, new: str, expected: str) -> None:
    assert old in BASE
    assert lines(tmp_path, BASE.replace(old, new, 1)) == [expected]


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        (
            "search:\n",
            "serach:\n",
            "tiny.yaml:20: serach: unknown key; allowed: study, title, question, seed, wavelengths, sensor, sensors, camera, pixel, pixels, lights, "
            "scenarios, columns, tolerance_dn, accuracy, geometry, cfas, colorants, designs, sweeps, boxes, production, population, uncertainty, regions, recognition, tasks, vision, metrics, effects, objective, constraints, search, validate, published, clouds; did you mean 'search'?",
        ),
        (
            "min: 590, max: 610",
            "min: 610, max: 590",
            "tiny.yaml:14: sweeps.edges.grid.left_nm: min 610 must not be above max 590",
        ),
        (
            "    channel: N\n",
            "    channel: NN\n",
            "tiny.yaml:10: sweeps.edges.channel: unknown channel of RYNCy (got 'NN'); allowed: R, Y, N, Cy; "
            "did you mean 'N'?",
        ),
        (
            "    base: Y\n",
            "    base: Yy\n",
            "tiny.yaml:11: sweeps.edges.base: unknown curve (got 'Yy'); allowed: C, R, G, B, Y, Cy, Rx; did you mean 'Y'?",
        ),
        (
            "[RGGB, RYNCy]",
            "[RGXB, RYNCy]",
            "tiny.yaml:4: cfas.RGXB: no curve for channel 'X'; allowed: a design, sweep or box with `channel: X`; or "
            "`curves: {X: ...}` of C, R, G, B, Y, Cy, Rx",
        ),
        (
            "sensor: ar0820",
            "sensor: ar0280",
            "tiny.yaml:2: sensor: unknown built-in sensor (got 'ar0280'); allowed: ar0820, ar0820@NUMBER, opencam, ar0132at, mt9v024, rawtoaces/NAME, or a mapping with `files`; "
            "did you mean 'ar0820'?",
        ),
        (
            "left_nm: {min: 590, max: 610, count: 3}",
            "left_um: {min: 0.59, max: 0.61, count: 3}",
            "tiny.yaml:14: sweeps.edges.grid.left_um: unknown parameter (got 'left_um'); allowed: left_nm, left_width_nm, "
            "right_nm, right_width_nm, depth; did you mean 'left_nm'?",
        ),
        (
            "right_nm: 650\n",
            "right_nm: 0.65\n",
            "tiny.yaml:16: sweeps.edges.grid.right_nm: out of range (got 0.65); allowed: 200 to 2000",
        ),
        (
            "sensitivity: {min: 0.9}",
            "sensitivity: {min: '0.9'}",
            "tiny.yaml:19: constraints.sensitivity.min: not allowed (got '0.9'); allowed: number",
        ),
        (
            "sensitivity: {min: 0.9}",
            "sensitivty: {min: 0.9}",
            "tiny.yaml:19: constraints.sensitivty: unknown quantity (got 'sensitivty'); allowed: csd_green_yellow, "
            "csd_green_orange, csd_green_red, csd_yellow_orange, csd_yellow_red, csd_orange_red, "
            "chromatic_csd_green_yellow, chromatic_csd_green_orange, chromatic_csd_green_red, chromatic_csd_yellow_orange, "
            "chromatic_csd_yellow_red, chromatic_csd_orange_red, sensitivity, cfa_sensitivity, slope_per_nm, min_transmission, "
            "edge_width_nm, band_width_nm, pixel_csd_green_yellow",
        ),
        (
            "  space: edges\n",
            "  space: edges\n  algorithm: COBYLLA\n",
            "tiny.yaml:22: search.algorithm: unknown algorithm",
        ),
        ("      right_nm: 650\n", "", "tiny.yaml:13: sweeps.edges.grid.right_nm: missing"),
        ("study: tiny\n", "study: tiny\nstudy: again\n", "tiny.yaml:2: found duplicate key"),
        ("[RGGB, RYNCy]", "[RGGB, RYNCy", "not valid YAML"),
        (
            "constraints:\n",
            "objective: {minimum: {csd_yellow_red: 1, csd_yelow_red: 2}}\nconstraints:\n",
            "tiny.yaml:18: objective.minimum.csd_yelow_red: unknown objective (got 'csd_yelow_red')",
        ),
        (
            "constraints:\n",
            "objective: {sum: {csd_yellow_red: -1}}\nconstraints:\n",
            "tiny.yaml:18: objective.sum.csd_yellow_red: not allowed (got -1)",
        ),
        ("constraints:\n", "objective: {}\nconstraints:\n", "tiny.yaml:18: objective: an objective is a quantity"),
        (
            "constraints:\n",
            "objective: worst_csd_yellow_red\nconstraints:\n",
            "tiny.yaml:18: objective: worst_csd_yellow_red needs `production.edge_shift_nm` or `population`; allowed: a shift above 0",
        ),
        (
            "constraints:\n",
            "production: {edge_shift: 2}\nconstraints:\n",
            "tiny.yaml:18: production.edge_shift: unknown key; allowed: edge_shift_nm, thickness, broadening; did you mean 'edge_shift_nm'?",
        ),
        (
            "constraints:\n",
            "constraints:\n  band_width_nm: {max: 30}\n",
            "tiny.yaml:19: constraints.band_width_nm.max: band_width_nm has no `max` (got 30.0); allowed: `min`",
        ),
        (
            "  space: edges\n",
            "  front: {min: 0.9, max: 1.0, count: 3}\nobjective: sensitivity\n",
            "search.front: the front is searched at levels of sensitivity, which is in the objective",
        ),
        (
            "lights: tl16\n",
            "lights: tl16\nwavelengths: {stop_nm: 800}\n",
            "tiny.yaml:4: wavelengths: the built-in curves end before the grid (got '400 to 800 nm'); allowed: 400 to 700 nm",
        ),
        (
            "lights: tl16\n",
            "lights: tl16\ngeometry:\n  near: {distance_km: 0.1, distance_m: 100, fov_deg: 60}\n",
            "tiny.yaml:5: geometry.near.distance_km: unknown key; allowed: distance_m, fov_deg, width_px, diameter_m; "
            "did you mean 'distance_m'?",
        ),
        ("sensor: ar0820\n", SENSOR_FILE, "tiny.yaml:4: sensor.files[0].file: no such file (got 'qe.csv')"),
        (
            "sensor: ar0820\n",
            "sensor: ar0820\npixel: {well_ke: 10}\n",
            "tiny.yaml:3: pixel.well_ke: unknown key; allowed: pitch_um, fill_factor, well_e, well_e_per_um2, bits, gain_dn_per_e, "
            "offset_dn, crosstalk, read_noise_e, dark_e_per_s, prnu, captures, merge, threshold, companding; did you mean 'well_e'?",
        ),
        (
            "lights: tl16\n",
            "lights: tl16\npixel: {pitch_um: .nan}\n",
            "tiny.yaml:4: pixel.pitch_um: not allowed (got nan)",
        ),
        ("[RGGB, RYNCy]", "[[RGGB], RYNCy]", "tiny.yaml:4: cfas: a list of CFAs holds names"),
        ("[RGGB, RYNCy]", "[RGGB, RYNCy, RGGB]", "tiny.yaml:4: cfas: a CFA is named twice"),
        ("  space: edges\n", "  front: {min: 0.9, max: 1.0, count: 1}\n", "search.front: count 1 goes with min = max"),
    ],
)
def test_a_fault_is_one_line(tmp_path: Path, old: str, new: str, expected: str) -> None:
    assert old in BASE
    with one_line(expected):
        load(tmp_path, BASE.replace(old, new, 1))


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("wavelengths: {step_nm: 5.0e-324}", "step_nm 4.94066e-324 is too fine: at most 20000 steps"),
        ("wavelengths: {start_nm: 1.0e-300, stop_nm: 1.0e-299}", "between 200 and 2000"),
        ("cfas: {X: {tile: [" + ", ".join(["[" + ", ".join("R" * 65) + "]"] * 2) + "]}}", "allowed: at most 64"),
        ("cfas: {X: {tile: [" + ", ".join(["[R]"] * 65) + "]}}", "allowed: at most 64"),
        ("sweeps: {e: {cfa: RGGB, channel: G, base: R, to: B, grid: {left_nm: {min: 1, max: 2, count: 1000000000}}}}", "1000000"),
        ("sweeps: {" + ", ".join(f"s{i}: {MANY}" for i in range(20)) + "}", "too many values of parameters"),
        ("scenarios: {a: {each: {off_axis_deg: {min: 0.0, max: 1.0, count: 1000000}}}}", "each.off_axis_deg: too many values"),
        ("scenarios: {a: {each: {x: {min: -1.0e+308, max: 1.0e+308, count: 3}}}}", "a number, a list of numbers"),
        ("scenarios: {a: {each: {off_axis_deg: {min: 0.0, max: 1.0, count: 2000}}, x: {y: [" + "0, " * 9999 + "0]}}}",
         "a.each: too many keys in all scenarios that it makes; allowed: at most 500,000"),
        ("scenarios: {" + ", ".join(f"s{i}: {{}}" for i in range(2001)) + "}", "too many scenarios (got 2001)"),
        ("scenarios: {a: {target: {distance_m: 9, fov_deg: 9, phase_px: [1.0e+10, 1]}}}", "a sampling phase is `any`"),
        ("constraints: {sensitivity: {min: 5.0e-324}}", "too near to 0"),
        ("recognition: {states: [" + ", ".join(f"s{i}" for i in range(41)) + "]}", "allowed: at most 40"),
    ],
)  # fmt: skip
def test_sizes_are_limited(tmp_path: Path, more: str, said: str) -> None:
    """Before anything of that size is made."""
    small = {"study": "study: a", "sensor": "sensor: ar0820", "lights": "lights: tl16", "cfas": "cfas: [RGGB]"}
    with one_line(said, alone=False), within(HANG_S):
        load(tmp_path, "\n".join((small | {more.split(":", maxsplit=1)[0]: more}).values()) + "\n")


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("objective: csd_red_yelow\n", "csd_yellow_red"),
        ("published: {table: {RGGB: {csd_red_yellow: 3}}}\n", "csd_yellow_red"),
    ],
)
def test_the_name_of_a_pair_is_proposed(tmp_path: Path, text: str, meant: str) -> None:
    assert issues(tmp_path, BASE + text)[0].endswith(f"did you mean {meant!r}?")
    name = text.partition("objective: ")[2].strip()
    if name:
        text = BASE.replace("sensitivity:", f"{name}:") + text.partition("objective:")[0]
        assert issues(tmp_path, text)[0].endswith(f"did you mean {meant!r}?")


@pytest.mark.parametrize(("said", "meant"), [("yes", "true"), ("On", "true"), ("no", "false"), ("off", "false")])
def test_yaml_1_1_booleans_are_reported_as_written(tmp_path: Path, said: str, meant: str) -> None:
    expected = f"true or false expected: write {meant} (got {said!r})"
    for section in ("scenarios: {chart: {noise: BOOLEAN}}\n", "validate: {leave_one_out: BOOLEAN}\n"):
        assert issues(tmp_path, BASE + section.replace("BOOLEAN", said))[0].endswith(expected)
    other = issues(tmp_path, BASE + "scenarios: {chart: {noise: loud}}\n")[0]
    assert other.endswith("not allowed (got 'loud'); allowed: true, false or a mapping")


@pytest.mark.parametrize(
    ("key", "text", "said"),
    [
        ("noise", "yes", "noise: unknown key"),
        ("scenarios.chart.noise", "yes", "scenarios.chart.noise: true or false expected"),
        ("pixel.offset_dn", "100000", "pixel: offset_dn 100000 must be below full scale"),
        ("sweeps.edges.grid.left_nm.min", "700", "sweeps.edges.grid.left_nm: min 700 must not be above max 610"),
        ("sweeps.edges", "{cfa: RYNCy, chanel: N}", "sweeps.edges.chanel: unknown key"),
        ("sweeps.edges.cfa", "RYNX", "sweeps.edges.cfa: unknown CFA (got 'RYNX')"),
        ("cfas.0", "RGB", "cfas.RGB: not the name of a 2x2 CFA"),
        ("search.space", "edgs", "search.space: unknown sweep or box"),
        (
            "accuracy.single_precision",
            "true",
            "accuracy.single_precision: unknown key, one of earlier versions; allowed: no such",
        ),
        ("scenarios.chart.each", "{off_axis_deg: ['1']}", "scenarios.chart.each.off_axis_deg: not a number (got '1')"),
        ("pixel.bits", "'12'", "pixel.bits: not allowed (got '12'); allowed: integer, without quotes"),
        ("cfas", "[]", "cfas: too few entries (got 0); allowed: 1 or more"),
        ("seed", "[", "not valid YAML"),
    ],
)
def test_a_fault_of_an_option_names_it(tmp_path: Path, key: str, text: str, said: str) -> None:
    path = tmp_path / "tiny.yaml"
    path.write_text(BASE)
    with one_line(f"--set {key}={text}: {said}"):
        load_study(path, changes={key: text})


def test_faults_of_the_file_beside_those_of_an_option_have_their_lines(tmp_path: Path) -> None:
    path = tmp_path / "tiny.yaml"
    path.write_text(MEANING)
    with pytest.raises(StudyError) as caught:
        load_study(path, changes={"search.space": "edgs", "cfas.0": "RGB"})
    places = [(issue.file, issue.line, issue.key) for issue in caught.value.issues]
    assert places == [
        (str(path), 9, "sweeps.edges.cfa"),
        (str(path), 19, "constraints.sensitivty"),
        ("--set cfas.0=RGB", None, "cfas.RGB"),
        ("--set search.space=edgs", None, "search.space"),
    ]


def test_published_names_are_checked(tmp_path: Path) -> None:
    def loaded(old: str, new: str) -> Study:
        path = tmp_path / "paper.yaml"
        text = (STUDIES / "paper.yaml").read_text()
        assert old in text
        path.write_text(text.replace(old, new, 1))
        return load_study(path)

    for old, new, word in (
        ("    RGGB: {csd", "    RGBG: {csd", "did you mean 'RGGB'"),
        ("RGGB: {csd_green_yellow", "RGGB: {csd_green_yelow", "did you mean 'csd_green_yellow'"),
        ("urban: {object_resolution_px", "urban: {sensitivity", "allowed: object_resolution_px"),
        ("at: paper_N2", "at: RYN5Cy", "unknown built-in filter"),
    ):
        with pytest.raises(StudyError, match=word):
            loaded(old, new)
