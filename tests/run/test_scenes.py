"""Runs of studies with scenes: planned, drawn, audited, measured."""

from __future__ import annotations

import re
from pathlib import Path

import pandas as pd
import pytest

from sweep.report import make_report, read_output
from sweep.report.sections.method import Method
from sweep.runs.audit import audit, audit_rows, sampled
from sweep.study import Study, load_study

from ..build import SCENES, load, output_of, ran
from ..conftest import STUDIES


@pytest.fixture(scope="module")
def road(tmp_path_factory: pytest.TempPathFactory) -> tuple[Study, Path]:
    """A study with a light at any place, and the folder of its run."""
    folder = tmp_path_factory.mktemp("scenes")
    study = load(folder, SCENES)
    ran(study, folder / "out", 1)
    return study, folder / "out"


@pytest.mark.slow
def test_scenes_are_planned_and_drawn(road: tuple[Study, Path]) -> None:
    study, folder = road
    assert list(study.scenarios) == ["road distance_m=150", "road distance_m=250"]
    frame = pd.read_parquet(folder / "results.parquet")
    assert set(frame["status"]) == {"ok"}
    assert (frame["csd_yellow_red"] < frame["best_phase_csd_yellow_red"]).all()
    assert (frame["omitted_effects_bound_dn"] <= 2.5).all()
    assert (frame["omitted_effects_bound_dn"] > 0).all()
    output = read_output(folder)
    make_report(output)
    assert "<svg" in (folder / "report.html").read_text()
    plans = output.provenance.plans
    assert frame["simulation_key"].iloc[0] == plans["road distance_m=150"].key
    check, seconds = output.provenance.check, output.provenance.seconds_of_effects
    assert check is not None
    assert check.passed
    assert seconds is not None
    own_s, every_s = seconds
    assert 0 < own_s < 10 * every_s
    (said,) = (line for line in next(iter(Method.of(output))).limits if line.startswith("Left out: "))
    assert re.search(r"at most [\d.e-]+ of \d+ DN, (no faster|[\d.]+ times faster, [\d.]+ s saved)\.$", said)


@pytest.mark.slow
def test_scenes_pass_an_audit(road: tuple[Study, Path]) -> None:
    _, folder = road
    lines = audit(folder, None).lines
    audited = pd.read_parquet(folder / "audit.parquet")
    frame = pd.read_parquet(folder / "results.parquet")
    assert lines[0].startswith(
        f"{len(audited)} of {len(frame)} designs computed again at the reference settings: no error"
    )
    assert (audited["realized_dn"] <= audited["allowed_dn"]).all()
    assert audited["realized_dn"].max() > 1e-9


def test_sampled_rows_are_the_front_and_a_hundredth() -> None:
    n = 50_000
    frame = pd.DataFrame(
        {
            "design_id": range(n),
            "kind": ["sweep"] * n,
            "status": ["ok"] * n,
        }
    )
    front = range(7, n, 5000)
    chosen = sampled(frame, front)
    assert chosen["design_id"].isin(front).sum() == 10
    assert 400 < len(chosen) < 600
    assert list(sampled(frame, front)["design_id"]) == list(chosen["design_id"])


@pytest.mark.usefixtures("plain_pictures")
def test_a_study_of_a_searched_box_alone(tmp_path: Path) -> None:
    text = (
        "study: box\nsensor: ar0820\nlights: tl16\nwavelengths: {step_nm: 5}\ncfas: [RYNCy]\n"
        "boxes: {x: {cfa: RYNCy, channel: N, base: Y, to: G, box: {left_nm: {min: 570, max: 630}, right_nm: {min: 640, max: 700}}}}\n"
        "scenarios: {a: {}, b: {off_axis_deg: 20}}\nsearch: {starts: 2, max_evaluations: 20, scenario: b}\n"
    )
    output = output_of(tmp_path, text)
    assert list(output.table["kind"]) == ["search"]
    assert list(output.table["scenario"]) == ["b"]
    make_report(output)


def test_an_audit_of_nothing_finds_nothing_broken() -> None:
    frame = pd.DataFrame({"design_id": [0], "kind": ["reference"], "status": ["not finite"]})
    assert audit_rows(load_study(STUDIES / "stopband.yaml"), [frame], ()).broken.empty
