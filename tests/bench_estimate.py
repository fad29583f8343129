"""What `sweep run --dry-run` says beside what runs take, one worker, seconds of the processor: a line per study.

    python -m tests.bench_estimate [STUDY ...]

The numbers of evaluations in `run/search_estimate.py` are from here.
"""

from __future__ import annotations

import sys
import tempfile
import time
from multiprocessing import get_context
from pathlib import Path
from unittest import mock

from sweep.report import make_report, read_output
from sweep.run import estimate, run_study
from sweep.study import load_study

from .conftest import STUDIES

USUAL = ("stopband", "fog", "distance", "dual", "angle", "robust")


def said(name: str) -> tuple[float, float]:
    """Seconds of the run and of the report, as a dry run tells them."""
    from sweep.report.estimate import report_seconds

    study = load_study(STUDIES / f"{name}.yaml")
    with tempfile.TemporaryDirectory() as folder, mock.patch("time.monotonic", time.process_time):
        return estimate(study, Path(folder) / name, 1, lambda *_: None).seconds, report_seconds(study)


def took(name: str) -> tuple[float, float, str]:
    """What the run and the report take, and how many evaluations its searches have."""
    study = load_study(STUDIES / f"{name}.yaml")
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / name
        begun = time.process_time()
        run_study(study, output, 1, lambda *_: None)
        ran = time.process_time()
        make_report(read_output(output))
        done = time.process_time()
        found = read_output(output).provenance.search
    searches = "" if found is None else f"; {found.evaluations} + {found.front_evaluations} evaluations"
    return ran - begun, done - ran, searches


def main(names: list[str]) -> None:
    with get_context("spawn").Pool(1, maxtasksperchild=1) as fresh:
        for name in names:
            told = fresh.apply(said, (name,))
            run_s, report_s, searches = fresh.apply(took, (name,))
            print(
                f"{name}: said {told[0]:.1f} + {told[1]:.1f} s (run + report), took {run_s:.1f} + {report_s:.1f} s, "
                f"ratio {sum(told) / (run_s + report_s):.2f}{searches}",
                flush=True,
            )


if __name__ == "__main__":
    main(sys.argv[1:] or list(USUAL))
