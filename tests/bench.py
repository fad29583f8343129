"""Speed, as ratios within one run: `make bench`. Writes outputs/bench/bench.json and .png; nothing here asserts a time.

The yardsticks: what an engineer would write instead (a script with SciPy's cdist, one design at a time), and what the
machine can do (matrix products, a bare Parquet write).
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
from typing import Any

import joblib
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from bench_ratios import BLOCK, median_s
from build import large
from scipy.integrate import trapezoid
from scipy.spatial.distance import cdist

from sweep.camera.model import SceneModel
from sweep.camera.setup import Setup
from sweep.designs.block import CurveBlock, edges_of
from sweep.designs.edge import SPAN_PER_WIDTH
from sweep.designs.space import Space
from sweep.metrics.evaluate import evaluate
from sweep.metrics.separation import class_pairs, csd_name, separation, separations_along
from sweep.runs import run_study
from sweep.study import Study, load_study

ROOT = Path(__file__).parent.parent
OUTPUT = ROOT / "outputs" / "bench"
SCRIPTED = 2000


def script(setup: Setup, target: np.ndarray, points: np.ndarray) -> np.ndarray:
    """All CSDs of stopbands, one design at a time, as an engineer writes it with NumPy and SciPy: ndarray[n, n_pairs].

    `target`: QE inside the band. What no design changes is computed once; edges are smooth steps; then a matrix-vector product, and `cdist`.
    """
    (modified,) = setup.camera.modified
    wave, base = setup.camera.grid.nodes_nm, setup.camera.qe[modified]
    scale = 0.95 * 4095 * setup.lights.photon_ratio / (trapezoid(setup.camera.qe).max() / (wave.size - 1))
    signals = setup.lights.photons * scale
    signals[:, [0, -1]] /= 2  # half a bin at each end of the range
    fixed = np.floor(setup.camera.qe @ signals.T + 0.5)
    members = list(setup.members.values())
    pairs = [(a, b) for at, a in enumerate(members) for b in members[at + 1 :]]
    found = np.empty((len(points), len(pairs)))
    for row, (left, left_width, right, right_width, depth) in enumerate(points):
        t = np.clip((wave - left) / (left_width * SPAN_PER_WIDTH) + 0.5, 0, 1)
        u = np.clip((wave - right) / (right_width * SPAN_PER_WIDTH) + 0.5, 0, 1)
        band = t * t * t * (t * (6 * t - 15) + 10) - u * u * u * (u * (6 * u - 15) + 10)
        qe = base + (target - base) * (depth * band)
        fixed[modified] = np.floor(signals @ qe + 0.5)
        seen = fixed.T
        found[row] = [cdist(seen[a], seen[b]).min() for a, b in pairs]
    return found


def swept(study: Study) -> tuple[Space, Setup]:
    """The study's sweep and its setup."""
    space = next(s for s in study.spaces if s.kind == "sweep")
    return space, study.setup(space, "chart")


def distances(imager: SceneModel, block: Any) -> None:
    """All CSDs of a block."""
    changing = imager.along(block)
    assert changing is not None
    members = imager.setup.members
    separations_along(changing.of.fixed[0], changing.of.channel, changing.make(slice(None))[:, 0], members)


def rate_of(route: str, study: Study, seconds: float) -> float:
    """Designs per second of a route in this process, over some seconds."""
    space, setup = swept(study)
    imager, points = SceneModel(setup), space.points(0, BLOCK)
    edges = edges_of(space, 0, BLOCK)
    assert edges is not None
    work: dict[str, Callable[[], object]] = {
        "separable": lambda: distances(imager, edges),
        "dense": lambda: distances(imager, CurveBlock(space.curves(points, setup.camera.grid.size))),
        "all_columns": lambda: evaluate(imager, edges),
    }
    work[route]()
    blocks, start = 0, time.perf_counter()
    while time.perf_counter() - start < seconds:
        work[route]()
        blocks += 1
    return blocks * BLOCK / (time.perf_counter() - start)


def on_all_cores(study: Study, found: dict[str, Any], seconds: float = 2.0) -> None:
    """(a, c) The same routes in one process per core at once, against one process."""
    cores = os.cpu_count() or 1
    parallel = joblib.Parallel(n_jobs=cores)
    for route in ("separable", "dense", "all_columns"):
        rates: dict[int, list[float]] = {1: [], cores: []}
        for _ in range(3):
            for count, measured in rates.items():
                measured.append(sum(parallel(joblib.delayed(rate_of)(route, study, seconds) for _ in range(count))))
        one, all_of_them = (statistics.median(measured) for measured in rates.values())
        found[f"{route}_designs_per_s_on_all_cores"] = all_of_them
        found[f"{route}_on_all_cores_over_script"] = all_of_them / found["script_designs_per_s"]
        found[f"{route}_on_all_cores_over_one"] = all_of_them / one


def kernels(study: Study, found: dict[str, Any]) -> None:
    """(a) Both routes against the scripts and the machine."""
    space, setup = swept(study)
    points = space.points(0, BLOCK)
    imager, members = SceneModel(setup), setup.members
    edges = edges_of(space, 0, BLOCK)
    assert edges is not None
    curves = space.curves(points, setup.camera.grid.size)
    flat, table = curves[:, 0], np.ascontiguousarray(setup.lights.photons.T)
    ours = evaluate(imager, edges)
    target = study.sensor.qe["G"]
    theirs = script(setup, target, points[:SCRIPTED]).T
    for pair, distances_dn in zip(class_pairs(list(members)), theirs, strict=True):  # the same figures, or no yardstick
        np.testing.assert_allclose(ours[csd_name(pair)][:SCRIPTED], distances_dn, rtol=1e-12)
    found["script_designs_per_s"] = SCRIPTED / median_s(lambda: script(setup, target, points[:SCRIPTED]), 5)
    found["separable_designs_per_s"] = BLOCK / median_s(lambda: distances(imager, edges), 30)
    found["dense_designs_per_s"] = BLOCK / median_s(
        lambda: distances(imager, CurveBlock(space.curves(points, setup.camera.grid.size)))
    )
    found["all_columns_designs_per_s"] = BLOCK / median_s(lambda: evaluate(imager, edges))
    bare = median_s(lambda: flat @ table, 30)
    product = median_s(lambda: CurveBlock(curves).product(table, np.arange(setup.camera.grid.size)), 30)
    found["dense_product_over_bare_product"] = bare / product
    found["dgemm_gflops"] = 2 * flat.shape[0] * flat.shape[1] * table.shape[1] / bare / 1e9
    large = np.ones(20_000_000)
    found["copy_gbytes_per_s"] = 2 * large.nbytes / median_s(large.copy, 3) / 1e9
    for route in ("separable", "dense", "all_columns"):
        found[f"{route}_over_script"] = found[f"{route}_designs_per_s"] / found["script_designs_per_s"]
    flops = 2 * flat.shape[1] * table.shape[1] * found["dense_designs_per_s"]
    found["dense_over_machine_product"] = flops / 1e9 / found["dgemm_gflops"]
    # A dense design writes its curve to memory and reads it; a separable one its response.
    for route, numbers in (("dense", flat.shape[1]), ("separable", table.shape[1])):
        moved = 2 * 8 * numbers * found[f"{route}_designs_per_s"] / 1e9
        found[f"{route}_bytes_over_machine_copy"] = moved / found["copy_gbytes_per_s"]
    changing = imager.along(edges)
    assert changing is not None
    fixed, values = changing.of.fixed[0], changing.make(slice(None))[:, 0]
    response = np.repeat(fixed[None], BLOCK, axis=0)
    response[..., changing.of.channel] = values
    arrays = median_s(lambda: [separation(response, members[a], members[b]) for a, b in class_pairs(list(members))])
    compiled = median_s(lambda: separations_along(fixed, changing.of.channel, values, members))
    found["compiled_pairs_over_numpy_pairs"] = arrays / compiled
    found["separable_over_dense"] = found["separable_designs_per_s"] / found["dense_designs_per_s"]


def end_to_end(found: dict[str, Any]) -> None:
    """(b, c) Four million designs to Parquet against a bare write of the same table, with one worker and two."""
    with tempfile.TemporaryDirectory(dir=OUTPUT) as folder:
        study = load_study(large(Path(folder), 80))
        seconds = {}
        for jobs in (1, 2):
            times = []
            for repeat in range(3):
                start = time.perf_counter()
                run_study(study, Path(folder) / f"{jobs}-{repeat}", jobs, lambda *_: None)
                times.append(time.perf_counter() - start)
            seconds[jobs] = statistics.median(times)
        table: pa.Table = pq.read_table(Path(folder) / "2-0" / "results.parquet")
        write = median_s(lambda: pq.write_table(table, Path(folder) / "bare.parquet"), 3)
    found["run_designs_per_s_1_worker"] = study.n_designs / seconds[1]
    found["run_designs_per_s_2_workers"] = study.n_designs / seconds[2]
    found["two_workers_over_one"] = seconds[1] / seconds[2]
    found["bare_write_designs_per_s"] = study.n_designs / write
    found["run_over_slower_of_kernel_and_write"] = found["run_designs_per_s_2_workers"] / min(
        found["bare_write_designs_per_s"], found["all_columns_designs_per_s_on_all_cores"]
    )


def drawn(found: dict[str, Any]) -> None:
    """The ratios as bars."""
    from matplotlib.figure import Figure

    ratios = {name.replace("_", " "): value for name, value in found.items() if "_over_" in name}
    figure = Figure(figsize=(8.5, 0.4 * len(ratios) + 1), layout="constrained")
    axes = figure.add_subplot()
    axes.barh(list(ratios), list(ratios.values()), color="#0072b2")
    for row, value in enumerate(ratios.values()):
        axes.annotate(f"{value:.3g}", (value, row), xytext=(3, -3), textcoords="offset points", fontsize=8)
    axes.set_xscale("log")
    axes.invert_yaxis()
    axes.set_title("ratios within one run")
    figure.savefig(OUTPUT / "bench.png", dpi=130)


def main() -> None:
    study = load_study(ROOT / "studies" / "stopband.yaml")
    found: dict[str, Any] = {}
    OUTPUT.mkdir(parents=True, exist_ok=True)
    kernels(study, found)
    on_all_cores(study, found)
    end_to_end(found)
    found["help_s"] = median_s(
        lambda: subprocess.run([sys.executable, "-m", "sweep", "--help"], capture_output=True, check=True)
    )
    found |= {"cores": os.cpu_count(), "platform": platform.platform()}
    (OUTPUT / "bench.json").write_text(json.dumps(found, indent=2) + "\n")
    drawn(found)
    for name, value in found.items():
        print(f"{name}: {value:,.3g}" if isinstance(value, float) else f"{name}: {value}")
    print(f"Kept in {OUTPUT.relative_to(ROOT)}/bench.json and bench.png.")


if __name__ == "__main__":
    main()
