"""Speed, as ratios within one run: `make bench`. Writes outputs/bench/bench.json; nothing here asserts a time.

The yardstick is what a user would write instead: a tidy script, one design at a time, with SciPy's cdist.
"""

from __future__ import annotations

import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.spatial.distance import cdist

from sweep.evaluate import evaluate
from sweep.imaging import imager_of
from sweep.runner import run_study
from sweep.study import load_study

ROOT = Path(__file__).parent.parent
REPEATS = 5
SCRIPT_DESIGNS = 300


def median_s(work: Callable[[], object], repeats: int = REPEATS) -> float:
    """Median wall time of `work`."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def main() -> None:
    study = load_study(ROOT / "studies" / "stopband.yaml")
    space = next(s for s in study.spaces if s.kind == "sweep")
    setup = study.setup(space, "chart")
    points = space.points(0, 4096)
    members = list(setup.members.values())
    white = setup.grid.size

    def script() -> None:
        """The same quantities, one design at a time."""
        for point in points[:SCRIPT_DESIGNS]:
            qe = setup.qe.copy()
            qe[setup.modified[0]] = space.curves(point[None], setup.grid.size)[0, 0]
            scale = 0.95 * 4095 * setup.lights.photon_ratio / (qe.sum(axis=1).max() / white)
            response = np.floor(setup.lights.photons @ qe.T * scale + 0.5)
            for i, first in enumerate(members):
                for second in members[i + 1 :]:
                    cdist(response[first], response[second]).min()

    def block() -> None:
        evaluate(imager_of(setup), space.curves(points, setup.grid.size))

    def whole(jobs: int) -> float:
        with tempfile.TemporaryDirectory() as folder:
            return median_s(lambda: run_study(study, Path(folder) / "out", jobs, lambda *_: None), 3)

    script_rate = SCRIPT_DESIGNS / median_s(script)
    block_rate = len(points) / median_s(block)
    one, two = whole(1), whole(2)
    start_up = median_s(
        lambda: subprocess.run([sys.executable, "-m", "sweep", "--help"], capture_output=True, check=True)
    )
    found = {
        "script_designs_per_s": script_rate,
        "block_designs_per_s": block_rate,
        "block_over_script": block_rate / script_rate,
        "stopband_run_1_worker_s": one,
        "stopband_run_2_workers_s": two,
        "two_workers_over_one": one / two,
        "run_2_workers_over_script": study.n_designs / two / script_rate,
        "help_s": start_up,
        "cores": os.cpu_count(),
        "platform": platform.platform(),
    }
    target = ROOT / "outputs" / "bench" / "bench.json"
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(json.dumps(found, indent=2) + "\n")
    for name, value in found.items():
        print(f"{name}: {value:,.3g}" if isinstance(value, float) else f"{name}: {value}")
    print(f"Kept in {target.relative_to(ROOT)}.")


if __name__ == "__main__":
    main()
