"""The same bits with any number of workers, and whatever number of threads the libraries are given."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from ..build import stopband_study
from ..mischief import assert_same_tables

STUDY = stopband_study(
    "tiny",
    "{left_nm: [590, 605, 690], left_width_nm: 5, right_nm: [420, 640, 655], right_width_nm: [5, 25]}",
    before="""\
pixel: {crosstalk: 0.02}
scenarios:
  chart: {}
  far: {target: {distance_m: 250, fov_deg: 30, phase_px: any}, optics: {f_number: 4}}
tolerance_dn: 20
search: {space: edges, starts: 2, max_evaluations: 30}
""",
    after="""\
  free:
    cfa: RYNCy
    family: free_form
    channel: N
    base: Y
    options: {nodes: {start_nm: 560, stop_nm: 680, step_nm: 40}}
    grid: {transmission_560_nm: [0.5, 1], transmission_600_nm: [0.2, 0.9], transmission_640_nm: [0.1, 1], transmission_680_nm: 1}
""",
)
RUN = """\
import sys
from pathlib import Path
from sweep.runs import run_study
from sweep.study import load_study
run_study(load_study(Path(sys.argv[1])), Path(sys.argv[2]), int(sys.argv[3]), lambda *_: None)
"""


def ran_with(folder: Path, jobs: int, threads: int) -> Path:
    """Folder of a run with so many workers, whose libraries are told to use so many threads."""
    study, out = folder / "tiny.yaml", folder / f"{jobs}-{threads}"
    study.write_text(STUDY)
    told = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), str(threads))
    command = [sys.executable, "-c", RUN, study, out, str(jobs)]
    subprocess.run(command, check=True, env={**os.environ, **told})
    return out


@pytest.mark.slow
@pytest.mark.long
def test_threads_and_workers_change_no_bit(tmp_path: Path) -> None:
    first = ran_with(tmp_path, 1, 1)
    for jobs, threads in ((1, 2), (1, 4), (2, 1), (2, 4)):
        assert_same_tables(first, ran_with(tmp_path, jobs, threads), "results", "search", "points", "curves")
