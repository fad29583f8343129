"""The lock of a folder on disks with and without flock: one command at a time, and none that is dead."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

from sweep.base.errors import OutputError
from sweep.results.lock import in_use, locked

fcntl = pytest.importorskip("fcntl")
HOLDER = """
import fcntl, os, sys
from pathlib import Path

def no_flock(*_):
    raise OSError(int(sys.argv[2]), "no flock")

fcntl.flock = no_flock
from sweep.results.lock import locked
with locked(Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
    os._exit(1)
"""


def without_flock(patch: pytest.MonkeyPatch, number: int) -> None:
    def no_flock(*_: object) -> None:
        raise OSError(number, os.strerror(number))

    patch.setattr(fcntl, "flock", no_flock)


@pytest.mark.parametrize("number", [errno.ENOSYS, errno.ENOTSUP, errno.ENOLCK])
def test_without_flock_a_lock_holds_and_gives_way_after_its_owner(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    without_flock(monkeypatch, number)
    with locked(tmp_path):
        assert in_use(tmp_path)
        with pytest.raises(OutputError, match="in use by another command"), locked(tmp_path):
            pass
    assert not in_use(tmp_path)
    holder = subprocess.Popen(
        [sys.executable, "-c", HOLDER, tmp_path, str(number)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert holder.stdin is not None
    assert holder.stdout is not None
    assert holder.stdout.readline() == "held\n"
    assert in_use(tmp_path)
    with pytest.raises(OutputError, match="in use by another command"), locked(tmp_path):
        pass
    holder.stdin.close()  # it ends without giving the lock back
    assert holder.wait(timeout=20) == 1
    holder.stdout.close()
    assert not in_use(tmp_path)
    with locked(tmp_path):
        assert in_use(tmp_path)


def test_another_fault_of_the_disk_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    without_flock(monkeypatch, errno.EIO)
    with pytest.raises(OutputError, match="cannot be written: Input/output error"), locked(tmp_path):
        pass


def test_a_lock_that_names_a_dead_process_gives_way(tmp_path: Path) -> None:
    (tmp_path / ".lock").write_text("999999999\nhost\n12345\n")
    with locked(tmp_path):
        assert in_use(tmp_path)
    assert not in_use(tmp_path)
