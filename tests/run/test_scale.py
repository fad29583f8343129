"""Runs of millions of designs: memory that does not grow, chunks that are planned at once."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pyarrow.parquet as pq
import pytest

from sweep.report import read_output, summary_lines
from sweep.report.page_data import payload
from sweep.report.values import drawn_rows
from sweep.results.thinning import MOST_ROWS
from sweep.study import load_study

from ..build import large, ran


@pytest.mark.slow
def test_a_long_table_is_drawn_thinned_but_with_its_whole_front(tmp_path: Path) -> None:
    path = large(tmp_path, 5)  # 250,000 designs
    ran(load_study(path), tmp_path / "out", 1)
    whole = pq.read_table(tmp_path / "out" / "results.parquet").to_pandas()
    assert pq.ParquetFile(tmp_path / "out" / "results.parquet").num_row_groups > 1
    output = read_output(tmp_path / "out")
    counts = output.counts
    assert counts.rows == len(whole) == 250_001
    assert counts.feasible() == whole["feasible"].sum()
    assert counts.front() == (whole["pareto"] & whole["feasible"]).sum()
    assert output.table["pareto"].sum() == whole["pareto"].sum()
    assert len(output.table) <= MOST_ROWS + counts.front() + 200
    assert len(drawn_rows(output)) < len(output.table) < len(whole)
    best = whole[whole["feasible"] & (whole["kind"] == "sweep")].nlargest(20, "csd_yellow_red")["csd_yellow_red"]
    assert list(output.best["csd_yellow_red"].head(20)) == list(best)
    assert f"the report draws {len(drawn_rows(output)):,} as points" in "\n".join(summary_lines(output))
    # The page's data does not grow with the table, but for the front.
    drawn = payload(output)
    front = whole[whole["pareto"] & whole["feasible"] & (whole["kind"] == "sweep")]
    assert {row[0] for row in drawn["front"]["rows"]} == set(front["design_id"])
    assert len(json.dumps(drawn)) < 3_000_000


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
    assert pq.read_metadata(tmp_path / "200" / "large" / "results.parquet").num_rows == 10_000_001
