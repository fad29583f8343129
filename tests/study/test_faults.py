"""Faults of a study are told with what was meant."""

from __future__ import annotations

from pathlib import Path

import pytest

from ..build import BASE, faults

NOISY = "recognition: {}\nscenarios: {chart: {noise: true}}\n"


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
    assert faults(tmp_path, BASE + text)[0].endswith(f"did you mean {meant!r}?")
    name = text.partition("objective: ")[2].strip()
    if name:
        text = BASE.replace("sensitivity:", f"{name}:") + text.partition("objective:")[0]
        assert faults(tmp_path, text)[0].endswith(f"did you mean {meant!r}?")


@pytest.mark.parametrize(("said", "meant"), [("yes", "true"), ("On", "true"), ("no", "false"), ("off", "false")])
def test_a_boolean_of_another_yaml_is_told_as_it_is_written(tmp_path: Path, said: str, meant: str) -> None:
    expected = f"true or false expected: write {meant} (got {said!r})"
    for section in ("scenarios: {chart: {noise: BOOLEAN}}\n", "validate: {leave_one_out: BOOLEAN}\n"):
        assert faults(tmp_path, BASE + section.replace("BOOLEAN", said))[0].endswith(expected)
    other = faults(tmp_path, BASE + "scenarios: {chart: {noise: loud}}\n")[0]
    assert other.endswith("not allowed (got 'loud'); allowed: true, false or a mapping")
