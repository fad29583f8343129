"""The audit of a run: which columns it compares, what it says, and what the command returns."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.base.errors import ErrorBoundExceededError
from sweep.cli import app as cli
from sweep.runs import run_study
from sweep.runs.audit import Audit, audit_rows, sampled
from sweep.study import Study, load_study

from ..build import stopband_study

STUDY = stopband_study(
    "audited",
    "{left_nm: [600, 610], left_width_nm: 20, right_nm: [640, 650], right_width_nm: 10}",
    before="""\
columns: all
wavelengths: {step_nm: 5}
pixel: {offset_dn: 168}
scenarios: {chart: {}, dim: {exposure: {kind: white_patch, level: 0.3}}}
tolerance_dn: 5
production: {edge_shift_nm: 2}
""",
    after="search: {starts: 1, max_evaluations: 10}\n",
)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Study, pd.DataFrame, set[int]]:
    folder = tmp_path_factory.mktemp("audit")
    (folder / "audited.yaml").write_text(STUDY)
    study = load_study(folder / "audited.yaml")
    run_study(study, folder / "out", 1, lambda *_: None)
    rows, front = (pd.read_parquet(folder / "out" / f"{name}.parquet") for name in ("results", "pareto"))
    return study, rows, {*front["design_id"]}


def test_every_csd_is_compared(run: tuple[Study, pd.DataFrame, set[int]]) -> None:
    study, frame, front = run
    assert audit_rows(study, [frame], front).issues == []
    has_error_bound = [name for name, quantity in study.quantities.items() if quantity.has_error_bound]
    assert [name for name in has_error_bound if name.startswith("worst_")]
    row = sampled(frame, front).index[-1]
    for name in has_error_bound:
        for wrong in (frame.loc[row, name] + 6, np.nan):
            changed = frame.copy()
            changed.loc[row, name] = wrong
            found = audit_rows(study, [changed], front)
            assert list(found.broken["design_id"]) == [frame.loc[row, "design_id"]]
            assert list(found.broken["quantity"]) == [name]
            assert f"design {frame.loc[row, 'design_id']}: {name} is off" in str(found.issues[0])


def broken_audit() -> Audit:
    columns = {"design_id": [3, 4, 7], "scenario": ["chart"] * 3, "plan": "x", "allowed_dn": 0.1}
    realized = {"realized_dn": [0.05, 1.4, 0.3], "quantity": "worst_csd_yellow_red"}
    realized |= {"realized_share": 0.0, "allowed_share": 0.01, "other": "sensitivity"}
    return Audit(pd.DataFrame(columns | realized), 1000)


def test_an_error_above_the_tolerance_has_an_exit_code_of_its_own(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.setattr("sweep.runs.audit.audit", lambda *_, **__: broken_audit().answer(tmp_path))
    monkeypatch.setattr(sys, "argv", ["sweep", "audit", str(tmp_path)])
    with pytest.raises(SystemExit) as left:
        cli.main()
    assert left.value.code == ErrorBoundExceededError.exit_code == 5
    said = capsys.readouterr()
    assert "2 errors are larger than allowed" in said.out
    assert said.err == (
        "sweep: chart: design 4: worst_csd_yellow_red is off by more than allowed (got '1.4 DN'); "
        "allowed: at most 0.1 DN\n"
    )
    kept = broken_audit().rows.iloc[:1]
    monkeypatch.setattr("sweep.runs.audit.audit", lambda *_, **__: Audit(kept, 1000).answer(tmp_path))
    with pytest.raises(SystemExit) as left:
        cli.main()
    assert not left.value.code
