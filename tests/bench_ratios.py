"""Ratios of times within one process, beside those of the last bench: `make bench`; `--check` fails where one fell by half.

Writes tests/bench_last.json, with the machine, unless it checks.
"""

from __future__ import annotations

import json
import os
import platform
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from build import large

from sweep.camera.model import SceneModel
from sweep.designs.block import CurveBlock, edges_of
from sweep.metrics.evaluate import evaluate
from sweep.runs import run_study
from sweep.runs.routes import Wanted
from sweep.runs.rows import rules_of
from sweep.study import load_study

LAST = Path(__file__).parent / "bench_last.json"
BLOCK, REPEATS = 4096, 15


def median_s(work: Callable[[], object], repeats: int = REPEATS) -> float:
    """Median wall time of `work`, once warm."""
    work()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def ratios() -> dict[str, float]:
    """Ratios of a sweep of stopbands; larger is better."""
    with tempfile.TemporaryDirectory() as folder:
        study = load_study(large(Path(folder), 8)).with_plans()
        space, rules = study.spaces[-1], rules_of(study)
        setup = study.setup(space, "chart")
        model, edges = SceneModel(setup), edges_of(space, 0, BLOCK)
        assert edges is not None

        def columns(wanted: Wanted) -> float:
            how = {"metrics": wanted.metrics, "chromatic": wanted.chromatic}
            return median_s(lambda: evaluate(model, edges, **how))  # type: ignore[arg-type]

        csds = median_s(lambda: evaluate(model, edges, metrics=[], chromatic=[]))
        asked, every = columns(rules.wanted_of_swept), columns(rules.wanted)
        points, table = space.points(0, BLOCK), np.ascontiguousarray(setup.lights.photons.T)
        curves = space.curves(points, setup.camera.grid.size)
        product = median_s(lambda: curves[:, 0] @ table)

        def dense() -> None:
            evaluate(model, CurveBlock(space.curves(points, setup.camera.grid.size)), metrics=[], chromatic=[])

        def run() -> None:
            with tempfile.TemporaryDirectory(dir=folder) as output:
                run_study(study, Path(output), 1, lambda *_: None, backend="threading")

        return {
            "csds_over_asked_columns": csds / asked,
            "csds_over_all_columns": csds / every,
            "dense_over_machine_product": product / median_s(dense),
            "run_over_kernel": asked * study.n_designs / BLOCK / median_s(run, 3),
        }


def main() -> None:
    found, known = ratios(), json.loads(LAST.read_text()) if LAST.exists() else {"ratios": {}}
    for name, value in found.items():
        print(f"{name}: {value:.3g} (last: {known['ratios'].get(name, float('nan')):.3g})")
    if "--check" in sys.argv:
        fallen = [name for name, value in found.items() if value < known["ratios"][name] / 2]
        sys.exit(f"fell by half: {', '.join(fallen)}" if fallen else 0)
    machine = {"cores": os.cpu_count(), "platform": platform.platform(), "processor": platform.processor()}
    LAST.write_text(json.dumps({"ratios": found, "machine": machine}, indent=2) + "\n")


if __name__ == "__main__":
    main()
