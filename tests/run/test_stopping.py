"""A stop ends a run within seconds wherever it is, loses nothing that is finished, and leaves no process behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import psutil
import pytest

from sweep.results.dataset import rows_in
from sweep.study import load_study

from ..build import STUDY, ran
from ..commanded import commanded
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


def noisy_study(folder: Path) -> Path:
    path = folder / "tiny.yaml"
    text = (
        STUDY.replace("COUNT", "5")
        .replace("count: 51", "count: 7")
        .replace("chart: {exposure: {kind: white_patch}}", "chart: {noise: true}")
    )
    text = text.replace("exposure_s: 0.002}}", "exposure_s: 0.002}, noise: true}")
    path.write_text(text + "recognition: {states: [green, yellow, red]}\n")
    return path


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


def wait_for(path: Path, run: subprocess.Popen[bytes] | Warm, folder: Path) -> None:
    deadline = time.monotonic() + 120
    while not path.exists():
        assert run.poll() is None, (folder / "said").read_text()
        assert time.monotonic() < deadline
        time.sleep(0.02)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("undisturbed")
    ran(load_study(noisy_study(folder)), folder / "out" / "tiny", 1)
    return folder / "out" / "tiny"


def stopped(folder: Path, phase: str, jobs: int, number: signal.Signals) -> float:
    """Stop a run that is busy in a phase; the seconds until it has ended. Its workers have ended, too."""
    noisy_study(folder)
    run = started(folder, jobs, *PHASES[phase])
    wait_for(folder / "slow.busy", run, folder)
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


def assert_continues(folder: Path, undisturbed: Path, jobs: int) -> None:
    """The same command, in this process."""
    code, _, said = commanded(*command(folder, "--jobs", str(jobs))[3:])
    assert code == 0, said
    names = ("results", "pareto", "designs", "search", "points", "curves")
    assert_same_tables(folder / "out" / "tiny", undisturbed, *names)
    assert not list((folder / "out").rglob(".tmp-*"))


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
    if phase == "sweep" and jobs == 2:
        assert rows_in(tmp_path / "out" / "tiny")[0] > 0
    assert_continues(tmp_path, undisturbed, jobs)


def workers_of(mark: str) -> list[psutil.Process]:
    """Processes that were started with a mark in their environment."""
    found = []
    for process in psutil.process_iter():
        with suppress(psutil.Error):
            if process.environ().get("SWEEP_MARK") == mark:
                found.append(process)
    return found


def begun(folder: Path, jobs: int) -> Warm:
    """A run without pictures, which has said that it began; its workers bear the folder as a mark."""
    run = Warm(*command(folder, "--jobs", str(jobs))[3:], said=folder / "said", SWEEP_MARK=str(folder))
    wait_for(folder / "out" / "tiny" / "manifest.json", run, folder)
    return run


@pytest.fixture(scope="module")
def whole_s(tmp_path_factory: pytest.TempPathFactory) -> float:
    """Seconds that a run takes which nobody disturbs, once it has said that it began."""
    folder = tmp_path_factory.mktemp("whole")
    noisy_study(folder)
    run = begun(folder, 2)
    started_s = time.monotonic()
    assert run.wait(timeout=120) == 0
    return time.monotonic() - started_s


def tracks_resources(process: psutil.Process) -> bool:
    try:
        return "resource_tracker" in " ".join(process.cmdline())
    except psutil.Error:
        return True  # it has ended


def emptied(folder: Path) -> None:
    for made in sorted(folder.rglob("*"), reverse=True):
        made.rmdir() if made.is_dir() else made.unlink()
    folder.rmdir()


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.usefixtures("plain_pictures")
@pytest.mark.parametrize("seed", range(2))
def test_kills_in_every_phase(tmp_path: Path, undisturbed: Path, whole_s: float, seed: int) -> None:
    """Parents and workers, by three signals, at random moments; the rows are those of an undisturbed run each time.

    Seven kills of each seed; a run that goes on may have another number of workers than the one that was killed.
    """
    rng = np.random.default_rng([17, seed])
    kills, out = {"run": 0, "worker": 0}, tmp_path / "out" / "tiny"
    noisy_study(tmp_path)
    while sum(kills.values()) < 7:
        run = begun(tmp_path, 1 + int(rng.integers(2)))
        time.sleep(float(rng.uniform(0, whole_s)))
        number = [signal.SIGKILL, signal.SIGTERM, signal.SIGINT][int(rng.integers(3))]
        if rng.random() < 0.4 and run.poll() is None:
            children = psutil.Process(run.pid).children(recursive=True)
            # Without its tracker of resources, which is no worker, loky prints what that had to clean up.
            for process in [child for child in children if not tracks_resources(child)][-1:]:
                process.kill()
                kills["worker"] += 1
            time.sleep(float(rng.uniform(0, whole_s / 2)))
        if run.poll() is None:
            os.kill(run.pid, number)
            kills["run"] += 1
        run.wait(timeout=120)
        _, alive = psutil.wait_procs(workers_of(str(tmp_path)), timeout=WITHIN_S)
        assert not alive
        said_text = (tmp_path / "said").read_text()
        assert "Traceback" not in said_text.partition("Exception ignored")[0], said_text  # in a library's callback
        if (out / "report.html").exists():
            assert_same_tables(out, undisturbed)
            emptied(out)
    assert_continues(tmp_path, undisturbed, 2)
