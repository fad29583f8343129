"""Rows that are audited, and a study of a box alone."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from sweep.features.audit.audit import audit_rows, sampled
from sweep.report import make_report
from sweep.study import load_study

from ..build import output_of
from ..conftest import STUDIES


def test_sampled_rows_are_the_front_and_a_hundredth() -> None:
    n = 50_000
    frame = pd.DataFrame({"design_id": range(n), "kind": "sweep", "status": "ok"})
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
