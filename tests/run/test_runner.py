"""Runs: the same rows however they are made, and nothing finished is lost."""

from __future__ import annotations

import resource
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.camera.scene import Scene
from sweep.designs.families.stopband import MultiStopband
from sweep.designs.space import Filter, Space
from sweep.metrics.bound import FEASIBLE
from sweep.metrics.pareto import non_dominated
from sweep.report import read_output
from sweep.results.answers import ANSWERS
from sweep.results.dataset import rows_in
from sweep.results.identity import CHUNK
from sweep.runs.rows import Job, rules_of, run_job
from sweep.study import Study, load_study
from sweep.study.axes import series_of

from ..build import ran, study_file
from ..mischief import assert_same_tables, half_done


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Study:
    return load_study(study_file(tmp_path_factory.mktemp("study")))


@pytest.fixture(scope="module")
def output(study: Study, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("out")
    ran(study, folder, 1)
    return folder


def test_rows_stand_in_order_with_their_columns(output: Path) -> None:
    frame = pd.read_parquet(output / "results.parquet")
    assert len(frame) == 2 * (2 + 1 + 26 * 2 * 51 * 2) + 1
    assert list(frame["design_id"]) == list(range(len(frame)))
    assert "pareto" not in frame.columns
    for name in ("pareto.parquet", "designs.parquet"):
        assert {*frame.columns, "chromatic_csd_orange_red", "pareto"} <= {*pd.read_parquet(output / name)}
    assert list(frame["kind"].iloc[[0, 1, 2, 3, -1]]) == ["reference", "reference", "design", "sweep", "search"]


def test_front_is_not_dominated(study: Study, output: Path) -> None:
    frame, fronts = (pd.read_parquet(output / name) for name in ("results.parquet", "pareto.parquet"))
    same = frame[frame["design_id"].isin(fronts["design_id"])].reset_index(drop=True)
    pd.testing.assert_frame_equal(fronts[list(frame)], same, check_categorical=False)
    assert set(read_output(output).front_ids) == set(fronts["design_id"])
    for scenario, group in frame[frame["kind"] != "reference"].groupby("scenario", observed=True):
        formed = study.spaces[-1].violation(group[list(study.parameters)].to_numpy(dtype=float)) <= FEASIBLE
        own = group[non_dominated(group[["csd_yellow_red", "sensitivity"]].to_numpy(), formed)]
        front = fronts[(fronts["kind"] != "reference") & (fronts["scenario"] == scenario)]
        assert list(front["design_id"]) == list(own["design_id"])
        assert len(front) > 3


def test_two_workers_give_the_same_rows(study: Study, output: Path, tmp_path: Path) -> None:
    ran(study, tmp_path, 2)
    assert_same_tables(tmp_path, output, "results", "pareto", "designs", "search", "curves")
    assert not (tmp_path / ANSWERS).exists()


def test_finished_parts_are_not_computed_again(study: Study, output: Path, tmp_path: Path) -> None:
    parts = half_done(study, tmp_path)
    parts[0].write_bytes(parts[0].read_bytes()[:-40])  # a torn file is computed again, not trusted
    left = parts[0].with_name(f".tmp-1-{parts[0].name}")  # of a process that was killed
    left.write_bytes(b"x")
    kept, _ = rows_in(tmp_path)
    assert kept > CHUNK
    seen = ran(study, tmp_path, 1)
    assert next(call for call in seen if call[0] == "designs") == ("designs", kept, study.n_designs)
    assert not left.exists()
    assert_same_tables(tmp_path, output)


def test_a_design_that_is_not_finite_is_a_row(study: Study) -> None:
    class Fragile(MultiStopband):
        def curves(self, x: np.ndarray) -> np.ndarray:
            made = super().curves(x)
            made[x[:, 0] == 5] = np.nan
            return made

    family = Fragile(study.grid.nodes_nm, study.sensor.qe["Y"], study.sensor.qe["G"], 1)
    axes = ((4.0, 5.0), (10.0,), (650.0,), (10.0,), (1.0,))
    space = Space("sweep", "fragile", "RYNCy", Filter(family, {"N": "Y"}, "G"), axes)
    rules = replace(rules_of(study), constraints={})
    rows = run_job(Job(0, "chart", 0, 2, 0, 0), replace(study, spaces=(space,)), rules).to_pandas()
    assert list(rows["status"]) == ["ok", "not finite"]
    assert list(rows["feasible"]) == [True, False]
    assert list(rows["csd_yellow_red"].isna()) == [False, True]
    assert not rows["pareto"][1]


@pytest.mark.slow
@pytest.mark.parametrize("jobs", [1, 2])
def test_a_full_disk_is_one_line_and_loses_nothing(tmp_path: Path, jobs: int) -> None:
    def small_files_only() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (210_000, 210_000))  # the study, but not each of its parts

    folder = tmp_path / "out" / "tiny"
    path = study_file(tmp_path)
    path.write_text(path.read_text() + "columns: all\n")
    run = subprocess.run(
        [sys.executable, "-m", "sweep", "run", path, "--output", tmp_path / "out", "--jobs", str(jobs)],
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
        preexec_fn=small_files_only,
    )
    assert (run.returncode, run.stderr.count("\n")) == (2, 1), run.stderr
    assert "cannot be written: File too large" in run.stderr
    assert not list(folder.rglob(".tmp-*"))
    kept, _ = rows_in(folder)
    assert kept or jobs > 1  # of two workers both may be at their first parts
    study = load_study(path)
    seen = ran(study, folder, 1)  # the disk has room again
    assert next(call for call in seen if call[0] == "designs")[1] == kept
    ran(study, tmp_path / "whole", 1)
    assert_same_tables(folder, tmp_path / "whole")


def test_a_scenario_may_have_any_name() -> None:
    assert series_of({"road speed=2": Scene(), "road speed=3": Scene()}) == {}
