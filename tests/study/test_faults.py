"""Faults of a study: all of the schema, then all of meaning, each at its place and with what was meant."""

from __future__ import annotations

from pathlib import Path

import pytest

from sweep.base.errors import StudyError
from sweep.study import Study, load_study

from ..build import BASE, issues, one_line
from ..conftest import STUDIES

MEANING = BASE.replace("    cfa: RYNCy", "    cfa: RYNX").replace("sensitivity:", "sensitivty:")
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
    ("text", "meant"),
    [
        ("objective: csd_red_yellow\n", "csd_yellow_red"),
        ("objective: csd_red_yelow\n", "csd_yellow_red"),
        ("objective: dprime_red_yellow\n", "dprime_yellow_red"),
        (NOISY + "objective: cnr_red_orange\n", "cnr_orange_red"),
        ("production: {edge_shift_nm: 1}\nobjective: worst_csd_red_yellow\n", "worst_csd_yellow_red"),
        ("published: {table: {RGGB: {csd_red_yellow: 3}}}\n", "csd_yellow_red"),
    ],
)
def test_the_name_of_a_pair_in_the_other_order_is_proposed(tmp_path: Path, text: str, meant: str) -> None:
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
        ("at: RYN2Cy", "at: RYN5Cy", "unknown built-in filter"),
    ):
        with pytest.raises(StudyError, match=word):
            loaded(old, new)
