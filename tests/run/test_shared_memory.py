"""Machines without shared memory for processes, and what processes that were killed left in it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from sweep.runs.workers import workers

from ..build import BASE
from ..mischief import assert_same_tables

WITHOUT = """
import sys, _multiprocessing
class Broken(_multiprocessing.SemLock):
    def __new__(cls, *_, **__):
        raise OSError(38, "Function not implemented")
_multiprocessing.SemLock = Broken
from sweep.cli.start import start
start()
"""


@pytest.mark.slow
def test_without_semaphores_threads_compute_the_same_rows(tmp_path: Path) -> None:
    (tmp_path / "tiny.yaml").write_text(BASE.replace("constraints:\n  sensitivity: {min: 0.9}\n", ""))
    with_processes = "from sweep.cli.start import start\nstart()"
    for name, code in (("threads", WITHOUT), ("processes", with_processes)):
        arguments = ["run", tmp_path / "tiny.yaml", "--output", tmp_path / name, "--jobs", "2"]
        done = subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        assert ("threads compute the same rows" in done.stderr) == (name == "threads")
    assert_same_tables(tmp_path / "threads" / "tiny", tmp_path / "processes" / "tiny")


@pytest.mark.skipif(not os.access("/dev/shm", os.W_OK), reason="no shared memory here")
def test_what_the_dead_left_in_shared_memory_is_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tempfile.gettempdir", lambda: str(tmp_path))
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    left = [
        Path("/dev/shm") / f"sem.loky-{dead.pid}-a1b2",
        Path("/dev/shm") / f"joblib_memmapping_folder_{dead.pid}_x_y",
    ]
    alive = [Path("/dev/shm") / f"sem.loky-{os.getpid()}-a1b2", tmp_path / f"joblib_memmapping_folder_{os.getpid()}_x"]
    try:
        for path in (left[0], alive[0]):
            path.touch()
        for folder in (left[1], alive[1], tmp_path / f"joblib_memmapping_folder_{dead.pid}_x", tmp_path / "mine"):
            folder.mkdir()
        with workers(1):
            pass
        assert not any(path.exists() for path in left)
        assert all(path.exists() for path in alive)
        assert sorted(path.name for path in tmp_path.iterdir()) == sorted([alive[1].name, "mine"])
    finally:
        alive[0].unlink(missing_ok=True)
