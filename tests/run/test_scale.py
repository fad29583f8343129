"""Runs of millions of designs: memory that does not grow, chunks that are planned at once."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pandas as pd
import psutil
import pytest

from sweep.report import read_output
from sweep.results.dataset import rows_in
from sweep.results.shown import BEST_PER_CFA, MOST_POINTS
from sweep.study import load_study

from ..build import large, ran


@pytest.mark.slow
def test_of_many_designs_few_are_shown_but_the_whole_front(tmp_path: Path) -> None:
    study = load_study(large(tmp_path, 5))  # 250,000 designs
    ran(study, tmp_path / "out", 1)
    whole, output = pd.read_parquet(tmp_path / "out" / "results.parquet"), read_output(tmp_path / "out")
    on_front = whole["design_id"].isin(pd.read_parquet(tmp_path / "out" / "pareto.parquet")["design_id"])
    assert sorted(output.front_ids) == list(whole.loc[on_front, "design_id"])
    swept = whole["feasible"] & (whole["kind"] == "sweep")
    counts, front = output.counts, whole[on_front & swept]
    assert (counts.rows, counts.feasible(), counts.front()) == (250_001, whole["feasible"].sum(), len(front))
    assert len(output.table) < 2 * MOST_POINTS + on_front.sum() + 1000
    best = whole[swept].nlargest(BEST_PER_CFA, "csd_yellow_red")["csd_yellow_red"]
    assert list(output.best["csd_yellow_red"].head(BEST_PER_CFA)) == list(best)


def peak_bytes(path: Path, output: Path) -> float:
    """Largest memory of a run and its workers together, each shared page once."""
    run = subprocess.Popen([sys.executable, "-m", "sweep", "run", str(path), "--output", str(output)])
    peak = 0.0
    while run.poll() is None:
        now = 0.0
        for process in [psutil.Process(run.pid), *psutil.Process(run.pid).children(recursive=True)]:
            try:
                now += process.memory_full_info().pss
            except psutil.Error:  # it has just ended
                continue
        peak = max(peak, now)
        time.sleep(0.5)
    assert run.returncode == 0
    return peak


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.skipif(not Path("/proc/self/smaps").exists(), reason="this system does not say who shares which memory")
def test_ten_million_designs_take_no_more_memory_than_one_million(tmp_path: Path) -> None:
    peaks = [peak_bytes(large(tmp_path, left), tmp_path / str(left)) for left in (20, 200)]
    workers = os.cpu_count() or 1
    assert peaks[1] < 2**30 * max(1.0, workers / 2), peaks
    assert peaks[1] < 1.2 * peaks[0], peaks
    assert rows_in(tmp_path / "200" / "large")[0] == 10_000_001
