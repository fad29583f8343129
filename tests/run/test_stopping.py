"""A stop ends a run within seconds wherever it is, loses nothing that is finished, and leaves no process behind."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import psutil
import pyarrow.parquet as pq
import pytest

from sweep.results.answers import ANSWERS

from ..build import STUDY, load, ran
from ..commanded import commanded
from ..features.sensors.test_several_folder import SEVERAL
from ..mischief import assert_same_tables
from ..warm import Warm

SLOWED = Path(__file__).parent.parent / "slowed"
SAID = "sweep: interrupted; finished parts are kept, the same command continues\n"
PHASES = {
    "search": ("sweep.search.solver:search_from", 3),
    "sweep": ("sweep.metrics.evaluate:evaluate", 6),
    "parts": ("sweep.results.dataset:encoded_part", 2),
    "tables": ("sweep.results.tables:write_table", 4),
    "check": ("sweep.runs.check:_checked", 1),
    "report": ("sweep.report.page:make_report", 1),
}
WITHIN_S = 15.0
"""The promise is five seconds on a machine that does nothing else."""


NOISY = (
    STUDY.replace("COUNT", "5")
    .replace("count: 51", "count: 7")
    .replace("chart: {exposure: {kind: white_patch}}", "chart: {noise: true}")
    .replace("exposure_s: 0.002}}", "exposure_s: 0.002}, noise: true}")
) + "recognition: {states: [green, yellow, red]}\n"
VISION = """\
study: few
sensor: ar0820
lights: tl16
pixel: {read_noise_e: 2, offset_dn: 168, well_e: 4000}
cfas: [RGGB, RYYCy]
vision:
  fov_deg: 120
  distances_m: [500]
  levels: {day: {illuminance_lx: 40000, exposure_s: 2.0e-5, phantom_cd: 50}}
  crop_px: 16
  places_per_pixel: 1
  prototypes: false
  seeds: 2
  train_images: 50
  check_images: 50
  test_images: 50
"""


def command(folder: Path, *extra: str) -> list[str]:
    return [sys.executable, "-m", "sweep", "run", str(folder / "tiny.yaml"), "--output", str(folder / "out"), *extra]


def started(folder: Path, jobs: int, place: str, call: int) -> subprocess.Popen[bytes]:
    """A run that is for a minute in one call."""
    slow = {"SWEEP_SLOW_AT": place, "SWEEP_SLOW_CALL": str(call), "SWEEP_SLOW_FILE": str(folder / "slow.calls")}
    with (folder / "said").open("w") as said:
        return subprocess.Popen(
            command(folder, "--jobs", str(jobs)),
            stdout=subprocess.DEVNULL,
            stderr=said,
            start_new_session=True,
            env={**os.environ, "PYTHONPATH": str(SLOWED), **slow},
        )


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("undisturbed")
    ran(load(folder, NOISY), folder / "out" / "tiny", 1)
    return folder / "out" / "tiny"


def stopped(folder: Path, phase: str, jobs: int, number: signal.Signals) -> float:
    """Stop a run that is busy in a phase; the seconds until it has ended. Its workers have ended, too."""
    (folder / "tiny.yaml").write_text(NOISY)
    run = started(folder, jobs, *PHASES[phase])
    deadline = time.monotonic() + 120
    while not (folder / "slow.busy").exists():
        assert run.poll() is None, (folder / "said").read_text()
        assert time.monotonic() < deadline
        time.sleep(0.02)
    own = psutil.Process(run.pid).children(recursive=True)
    begun = time.monotonic()
    if number == signal.SIGINT:
        os.killpg(run.pid, number)  # as Ctrl-C on a terminal
    else:
        run.send_signal(number)
    assert run.wait(timeout=60) == 130
    seconds = time.monotonic() - begun
    _, alive = psutil.wait_procs(own, timeout=WITHIN_S)
    assert not alive
    said = (folder / "said").read_text()
    assert [line for line in said.splitlines(keepends=True) if " left" not in line] == [SAID]  # but for progress
    return seconds


@pytest.mark.usefixtures("plain_pictures")
@pytest.mark.parametrize(
    ("phase", "jobs", "number"),
    [
        pytest.param(phase, jobs, number, marks=pytest.mark.slow)
        for phase in PHASES
        for jobs, number in ((1, signal.SIGTERM), (2, signal.SIGINT))
    ]
    + [pytest.param("sweep", 2, signal.SIGHUP, marks=pytest.mark.slow)],
)
def test_a_stop_ends_every_phase(
    tmp_path: Path, undisturbed: Path, phase: str, jobs: int, number: signal.Signals
) -> None:
    assert stopped(tmp_path, phase, jobs, number) < WITHIN_S
    code, _, said = commanded(*command(tmp_path, "--jobs", str(jobs))[3:])  # the same command, in this process
    assert code == 0, said
    names = ("results", "pareto", "designs", "search", "points", "curves")
    assert_same_tables(tmp_path / "out" / "tiny", undisturbed, *names)
    assert not list((tmp_path / "out").rglob(".tmp-*"))


def workers_of(mark: str) -> list[psutil.Process]:
    """Processes that were started with a mark in their environment."""
    found = []
    for process in psutil.process_iter():
        with suppress(psutil.Error):
            if process.environ().get("SWEEP_MARK") == mark:
                found.append(process)
    return found


def tracks_resources(process: psutil.Process) -> bool:
    try:
        return "resource_tracker" in " ".join(process.cmdline())
    except psutil.Error:
        return True  # it has ended


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.usefixtures("plain_pictures")
@pytest.mark.parametrize(
    ("text", "seed"),
    [(NOISY, 0), (SEVERAL, 0), (VISION, 0)],
    ids=["plain", "several", "vision"],
)
def test_kills_at_random_moments_lose_nothing(tmp_path: Path, text: str, seed: int) -> None:
    """Processes, their groups and workers, by three signals; the rows are those of an undisturbed run each time.

    Three kills of each; a run that goes on may have another number of workers than the one that was killed.
    """
    rng, kills = np.random.default_rng([17, seed]), 0
    (tmp_path / "tiny.yaml").write_text(text)

    def begun(name: str, jobs: int) -> Warm:
        """A run without pictures; its workers bear the folder as a mark."""
        arguments = ("run", tmp_path / "tiny.yaml", "--output", tmp_path / name, "--jobs", jobs)
        return Warm(*arguments, said=tmp_path / "said", SWEEP_MARK=str(tmp_path))

    def assert_ended(run: Warm) -> int:
        code = run.wait(timeout=120)
        _, alive = psutil.wait_procs(workers_of(str(tmp_path)), timeout=WITHIN_S)
        assert not alive
        said = (tmp_path / "said").read_text()
        assert "Traceback" not in said.partition("Exception ignored")[0], said  # in a library's callback
        return code

    def assert_same() -> None:
        for table in (tmp_path / "undisturbed").rglob("*.parquet"):
            again = tmp_path / "out" / table.relative_to(tmp_path / "undisturbed")
            assert pq.read_table(again).equals(pq.read_table(table)), table.name

    started_s = time.monotonic()
    assert assert_ended(begun("undisturbed", 2)) == 0
    whole_s = time.monotonic() - started_s
    while kills < 3:
        run = begun("out", 1 + int(rng.integers(2)))
        time.sleep(float(rng.uniform(0, whole_s)))
        number = [signal.SIGKILL, signal.SIGTERM, signal.SIGINT][int(rng.integers(3))]
        if rng.random() < 0.3 and run.poll() is None:
            children = psutil.Process(run.pid).children(recursive=True)
            # Without its tracker of resources, which is no worker, loky prints what that had to clean up.
            for process in [child for child in children if not tracks_resources(child)][-1:]:
                process.kill()
                kills += 1
            time.sleep(float(rng.uniform(0, whole_s / 2)))
        if run.poll() is None:
            (os.killpg if rng.random() < 0.3 else os.kill)(run.pid, number)
            kills += 1
        assert_ended(run)
        if [*(tmp_path / "out").glob("*/report.html")]:
            assert_same()
            shutil.rmtree(tmp_path / "out")
    assert assert_ended(begun("out", 2)) == 0
    assert_same()
    assert not [*(tmp_path / "out").rglob(".tmp-*"), *(tmp_path / "out").rglob(ANSWERS)]
