"""The audit of a run: which columns it compares, what it says, and what the command returns."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.features.audit.audit import audit_rows, sampled
from sweep.runs import run_study
from sweep.study import Study, load_study

from ...build import stopband_study

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
            problem = found.answer(Path()).problem
            assert problem is not None
            assert problem.exit_code == 5
