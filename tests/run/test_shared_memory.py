"""Machines without shared memory for processes, and what processes that were killed left in it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

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
