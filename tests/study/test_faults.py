"""Faults of a study: of the schema and of meaning, each at its place and with what was meant."""

from __future__ import annotations

from pathlib import Path

import pytest

from sweep.base.errors import StudyError
from sweep.study import load_study

from ..build import BASE, issues, load, one_line
from ..watchdog import within

MEANING = BASE.replace("    cfa: RYNCy", "    cfa: RYNX").replace("sensitivity:", "sensitivty:")
HANG_S = 120.0
AXES = ", ".join(f"x{i}: {{min: 590, max: 610, count: 1000000}}" for i in range(50))
MANY = f"{{cfa: RGGB, channel: G, base: G, to: B, grid: {{{AXES}}}}}"


def lines(tmp_path: Path, text: str) -> list[str]:
    """The line and the key of each fault."""
    return ["".join(issue.split(":")[1:3]) for issue in issues(tmp_path, text)]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (MEANING + "foo: 1\n", ["9 sweeps.edges.cfa", "19 constraints.sensitivty", "22 foo"]),
        (
            MEANING.replace("study: tiny\n", "").replace("space: edges", "starts: 0"),
            ["1 study", "8 sweeps.edges.cfa", "18 constraints.sensitivty", "20 search.starts"],
        ),
        (
            MEANING.replace("ar0820", "ar0280").replace("space: edges", "scenario: dusk"),
            ["2 sensor", "9 sweeps.edges.cfa", "19 constraints.sensitivty", "21 search.scenario"],
        ),
        (
            MEANING.replace("tl16", "tl61").replace("space: edges", "algorithm: SLSQ") + "metrics: nothing.py:NAME\n",
            ["3 lights", "9 sweeps.edges.cfa", "21 search.algorithm", "22 metrics"],
        ),
    ],
)
def test_errors_of_the_schema_hide_no_errors_of_meaning(tmp_path: Path, text: str, expected: list[str]) -> None:
    assert lines(tmp_path, text) == expected


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("search:\n", "validate: {leave_one_out: true}\nsearch:\n  starts: 0\n", "22 search.starts"),
        ("    base: Y\n", "    bse: Y\n", "11 sweeps.edges.bse"),
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
        ("    channel: N\n", "    channel: NN\n", "10: sweeps.edges.channel: unknown channel"),
        ("    base: Y\n", "    base: Yy\n", "11: sweeps.edges.base: unknown curve"),
        ("[RGGB, RYNCy]", "[RGXB, RYNCy]", "4: cfas.RGXB: no curve for channel 'X'"),
        ("left_nm: {min", "left_um: {min", "14: sweeps.edges.grid.left_um: unknown parameter"),
        ("right_nm: 650\n", "right_nm: 0.65\n", "16: sweeps.edges.grid.right_nm: out of range"),
        ("min: 0.9", "min: '0.9'", "19: constraints.sensitivity.min: not allowed"),
        ("lights: tl16\n", "lights: tl16\nscenarios: {chart: {noise: yes}}\n", "true or false expected: write true"),
        ("      right_nm: 650\n", "", "tiny.yaml:13: sweeps.edges.grid.right_nm: missing"),
        ("study: tiny\n", "study: tiny\nstudy: again\n", "tiny.yaml:2: found duplicate key"),
        ("[RGGB, RYNCy]", "[RGGB, RYNCy", "not valid YAML"),
        (
            "constraints:\n",
            "objective: {minimum: {csd_red_yelow: 1}}\nconstraints:\n",
            "18: objective.minimum.csd_red_yelow: unknown objective (got 'csd_red_yelow')",
        ),
        ("constraints:\n", "objective: {}\nconstraints:\n", "18: objective: an objective is a quantity"),
        (
            "constraints:\n",
            "objective: worst_csd_yellow_red\nconstraints:\n",
            "18: objective: worst_csd_yellow_red needs `production.edge_shift_nm`",
        ),
        (
            "constraints:\n",
            "constraints:\n  band_width_nm: {max: 30}\n",
            "19: constraints.band_width_nm.max: band_width_nm has no `max`",
        ),
        (
            "  space: edges\n",
            "  front: {min: 0.9, max: 1.0, count: 3}\nobjective: sensitivity\n",
            "search.front: the front is searched at levels of sensitivity",
        ),
        ("lights: tl16\n", "lights: tl16\nwavelengths: {stop_nm: 800}\n", "4: wavelengths: the built-in curves end"),
        ("lights: tl16\n", "lights: tl16\npixel: {pitch_um: .nan}\n", "4: pixel.pitch_um: not allowed"),
        ("[RGGB, RYNCy]", "[[RGGB], RYNCy]", "4: cfas: a list of CFAs holds names"),
        ("[RGGB, RYNCy]", "[RGGB, RYNCy, RGGB]", "4: cfas: a CFA is named twice"),
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
        ("sweeps: {" + ", ".join(f"s{i}: {MANY}" for i in range(20)) + "}", "too many values of parameters"),
        ("scenarios: {a: {each: {off_axis_deg: {min: 0.0, max: 1.0, count: 1000000}}}}", "each.off_axis_deg: too many values"),
        ("scenarios: {a: {each: {x: {min: -1.0e+308, max: 1.0e+308, count: 3}}}}", "a number, a list of numbers"),
        ("scenarios: {a: {each: {off_axis_deg: {min: 0.0, max: 1.0, count: 2000}}, x: {y: [" + "0, " * 9999 + "0]}}}",
         "a.each: too many keys in all scenarios that it makes; allowed: at most 500,000"),
        ("scenarios: {" + ", ".join(f"s{i}: {{}}" for i in range(2001)) + "}", "too many scenarios (got 2001)"),
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
    ("key", "text", "said"),
    [
        ("noise", "yes", "noise: unknown key"),
        ("scenarios.chart.noise", "yes", "scenarios.chart.noise: true or false expected"),
        ("pixel.offset_dn", "100000", "pixel: offset_dn 100000 must be below full scale"),
        ("sweeps.edges.grid.left_nm.min", "700", "sweeps.edges.grid.left_nm: min 700 must not be above max 610"),
        ("cfas.0", "RGB", "cfas.RGB: not the name of a 2x2 CFA"),
        ("scenarios.chart.each", "{off_axis_deg: ['1']}", "scenarios.chart.each.off_axis_deg: not a number (got '1')"),
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
