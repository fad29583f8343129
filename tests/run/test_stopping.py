"""A stop ends a run within seconds wherever it is, loses nothing that is finished, and leaves no process behind."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import joblib
import numpy as np
import psutil
import pyarrow.parquet as pq
import pytest

from sweep.base.errors import InterruptedRunError
from sweep.run.stop import GRACE_S, BrokenOffError, Stop, stop_on_signals
from sweep.run.workers import Workers, workers
from sweep.study import load_study

from ..build import STUDY, ran
from ..commanded import commanded
from ..warm import Warm

SLOWED = Path(__file__).parent.parent / "slowed"
SAID = "sweep: interrupted; finished chunks are kept, the same command continues\n"
PHASES = {
    "search": ("sweep.search.solver:search_from", 3),
    "sweep": ("sweep.metrics.evaluate:evaluate", 6),
    "recognition": ("sweep.metrics.recognition:recognize", 2),
    "tables": ("sweep.results.joined:Joining.finish", 1),
    "points": ("sweep.results.tables:write_table", 2),
    "check": ("sweep.run.check:_checked", 1),
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
    path.write_text(text + "recognition: {states: [green, yellow, red], patches: 40}\n")
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


def kept_rows(folder: Path) -> int:
    journal = folder / "out" / "tiny" / "shards" / "_journal.jsonl"
    return sum(json.loads(line)["rows"] for line in journal.read_text().splitlines()) if journal.exists() else 0


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
    for name in ("results", "search", "points", "recognition", "curves"):
        tables = [pq.read_table(place / f"{name}.parquet") for place in (folder / "out" / "tiny", undisturbed)]
        assert tables[0].equals(tables[1]), name
    assert not list((folder / "out").rglob(".tmp-*"))


@pytest.mark.usefixtures("plain_pictures")
@pytest.mark.parametrize(
    ("phase", "jobs", "number"),
    [
        pytest.param(phase, jobs, number, marks=pytest.mark.slow)
        for phase in PHASES
        for jobs, number in ((1, signal.SIGTERM), (2, signal.SIGINT))
    ],
)
def test_a_stop_ends_every_phase(
    tmp_path: Path, undisturbed: Path, phase: str, jobs: int, number: signal.Signals
) -> None:
    assert stopped(tmp_path, phase, jobs, number) < WITHIN_S
    if phase == "sweep" and jobs == 2:
        assert kept_rows(tmp_path) > 0
    assert_continues(tmp_path, undisturbed, jobs)


def raised_after(stop: Stop, at_most_s: float) -> float:
    begun = time.monotonic()
    try:
        while time.monotonic() < begun + at_most_s:
            time.sleep(0.01)
    except BrokenOffError:
        return time.monotonic() - begun
    raise AssertionError(f"not broken off, asked: {stop.requested}")


def asked() -> None:
    os.kill(os.getpid(), signal.SIGTERM)


def in_peace(stop: Stop) -> None:
    with stop.held():
        asked()
        time.sleep(0.3)  # nothing is raised here
        assert stop.requested
    raised_after(stop, 30)


def with_grace(stop: Stop) -> None:
    with stop.grace():
        asked()
        assert raised_after(stop, 30) >= GRACE_S


def swallowed(stop: Stop) -> None:
    with suppress(BrokenOffError):  # as a library may do
        asked()
        time.sleep(30)
    raised_after(stop, 30)


def asked_twice(stop: Stop) -> None:
    with stop.grace():
        asked()
        time.sleep(0.1)
        asked()  # whoever asks again does not wait
        assert raised_after(stop, 30) < GRACE_S


def asleep(_stop: Stop) -> None:
    asked()
    time.sleep(30)


@pytest.mark.parametrize(
    "work",
    [in_peace, asked_twice, asleep, *(pytest.param(work, marks=pytest.mark.slow) for work in (with_grace, swallowed))],
)
def test_a_stop_breaks_off_at_once_but_what_is_held_or_has_grace(work: Callable[[Stop], None]) -> None:
    def run() -> None:
        with stop_on_signals() as stop:
            work(stop)
            raise BrokenOffError  # as it would have been

    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    with pytest.raises(InterruptedRunError, match="the same command continues"):
        run()
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == before


def later(seconds: float, number: int) -> int:
    time.sleep(seconds)
    return number


SLOWER_S = {"loky": 2.0, "threading": 0.2}
"""What the others are handed on before: for processes, their start."""


@pytest.mark.parametrize("backend", SLOWER_S)
def test_results_are_handed_on_as_they_finish_and_given_in_order(backend: str) -> None:
    finished: list[int] = []
    with workers(Workers(2, Stop(), backend)) as crew:
        calls = (joblib.delayed(later)(SLOWER_S[backend] if number == 0 else 0.0, number) for number in range(6))
        assert list(crew(calls, finished=lambda at, _: finished.append(at))) == list(range(6))
    assert sorted(finished) == list(range(6))
    assert finished[0] != 0  # the slow one did not hold up what was finished beside it


@pytest.mark.slow
def test_a_worker_whose_parent_was_killed_before_it_began_ends() -> None:
    program = "import os, sys; from sweep.run.worker_process import prepare_worker; prepare_worker({}); print('lives')"
    for parent, said in (("os.getppid()", "lives\n"), ("os.getppid() + 1", "")):
        ended = subprocess.run(
            [sys.executable, "-c", program.format(parent)], capture_output=True, text=True, check=False
        )
        assert (ended.stdout, ended.stderr, ended.returncode) == (said, "", int(not said))


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
    wait_for(folder / "out" / "tiny" / "run.json", run, folder)
    return run


def computing(run: Warm) -> list[psutil.Process]:
    """Worker processes of a run, but not the one by which loky keeps watch over what they share."""
    found = []
    for process in psutil.Process(run.pid).children(recursive=True):
        with suppress(psutil.Error):
            if any("LokyProcess" in word for word in process.cmdline()):
                found.append(process)
    return found


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
@pytest.mark.parametrize("seed", range(4))
def test_forty_kills_in_every_phase(tmp_path: Path, undisturbed: Path, whole_s: float, seed: int) -> None:
    """Parents and workers, by three signals, at random moments; the rows are those of an undisturbed run each time.

    Ten kills of each seed; a run that goes on may have another number of workers than the one that was killed.
    """
    rng = np.random.default_rng([17, seed])
    kills, out = {"run": 0, "worker": 0}, tmp_path / "out" / "tiny"
    noisy_study(tmp_path)
    while sum(kills.values()) < 10:
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
        assert "Traceback" not in said_text, said_text
        if (out / "report.html").exists():
            assert pq.read_table(out / "results.parquet").equals(pq.read_table(undisturbed / "results.parquet"))
            emptied(out)
    assert_continues(tmp_path, undisturbed, 2)


def test_a_pool_that_misses_its_workers_after_a_stop_is_no_news(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(threading, "excepthook", threading.__excepthook__)

    def fails() -> None:
        raise OSError("handle is closed")

    def told(name: str) -> str:
        thread = threading.Thread(target=fails, name=name)
        thread.start()
        thread.join()
        return capsys.readouterr().err

    with stop_on_signals() as stop:
        assert "handle is closed" in told("ExecutorManagerThread")
        stop._request()
        assert told("ExecutorManagerThread") == ""
        assert "handle is closed" in told("another")


FORGETFUL = """
import os, signal, time
import numpy as np
from scipy.stats import qmc
from sweep.base.errors import InterruptedRunError
from sweep.run.stop import stop_on_signals

def asked(*_):
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(30)

np.lib.npyio.NpzFile.__getitem__ = asked  # SciPy's compiled code reads its table by this and cannot hand an exception on
try:
    with stop_on_signals():
        qmc.Sobol(2, rng=1)
        time.sleep(30)
        print("forgotten")
except InterruptedRunError as stopped:
    print(stopped)
"""


def test_what_compiled_code_forgets_is_broken_off_again_without_news() -> None:
    done = subprocess.run([sys.executable, "-c", FORGETFUL], capture_output=True, text=True, timeout=60, check=True)
    assert (done.stderr, done.stdout) == ("", "interrupted; finished chunks are kept, the same command continues\n")
