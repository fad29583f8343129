"""One command at a time writes into a run's folder."""

from __future__ import annotations

import fcntl
import os
import re
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

from ..base.disk import is_real_folder, opened, read_plain
from ..base.errors import Fault, OutputError
from .journal import SHARDS
from .names import FIGURES

LOCK = ".lock"
_ATTEMPTS, _PAUSE_S = 5, 0.02
_SAYS = re.compile(rb"(process \d+ on [^\n]*)?")
_MOST_SAID = 400
_LEFT_OVER = re.compile(r"\.tmp-\d+-(SHA256SUMS|[\w.-]+\.(parquet|json|yaml|html|csv|png|svg))")
"""Hidden names that `atomic.atomic` gives to files of a run."""


@contextmanager
def locked(output: Path) -> Iterator[None]:
    """Hold the output folder for one command; raises OutputError, naming the holder, when it is in use.

    The kernel drops the lock with its process, so a lock cannot go stale. Hidden files that a killed command, or a
    worker of this one, left behind are removed. A `.lock` that is a link, or that holds something else, is not touched.
    """
    lock = output / LOCK
    try:
        output.mkdir(parents=True, exist_ok=True)
        if os.path.lexists(lock) and not _is_ours(lock):
            raise OutputError(Fault("is not of this run; move it away", str(lock), allowed="another --output"))
        handle = opened(lock, os.O_RDWR | os.O_CREAT, "r+b")
    except OSError as error:
        raise OutputError(Fault(f"cannot be written: {error.strerror or error}", str(output))) from None
    with handle:
        for attempt in range(_ATTEMPTS):
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except OSError:
                if attempt == _ATTEMPTS - 1:
                    raise OutputError(Fault(f"in use by another run ({_said(handle)})", str(output))) from None
                time.sleep(_PAUSE_S)  # someone may just be looking who holds it
        _say(handle, output)
        _clear(output)
        try:
            yield
        finally:
            with suppress(OSError):
                _clear(output)


def holder(output: Path) -> str | None:
    """Which command holds the folder, in words; None when none does."""
    try:
        handle = opened(output / LOCK)
    except OSError:
        return None
    with handle:
        try:
            fcntl.flock(handle, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except OSError:
            return _said(handle)
        return None


def _is_ours(lock: Path) -> bool:
    """Whether a file says what a lock says; one that is a link, a folder or longer does not."""
    try:
        return _SAYS.fullmatch(read_plain(lock, _MOST_SAID)) is not None
    except PermissionError:
        raise
    except OSError:
        return False


def _say(handle: IO[bytes], output: Path) -> None:
    """Write into the lock who holds it; raises OutputError when the disk refuses."""
    try:
        os.ftruncate(handle.fileno(), 0)
        os.pwrite(handle.fileno(), f"process {os.getpid()} on {socket.gethostname()}".encode(), 0)
    except OSError as error:
        raise OutputError(Fault(f"cannot be written: {error.strerror or error}", str(output))) from None


def _said(handle: IO[bytes]) -> str:
    handle.seek(0)
    return handle.read(_MOST_SAID).decode("utf-8", "replace").strip() or "process ?"


def _clear(output: Path) -> None:
    """Remove what killed commands and workers left half written, but not through links."""
    own = (output / SHARDS, output / FIGURES)
    for folder in (output, *(inner for inner in own if is_real_folder(inner))):
        for path in folder.iterdir():
            if _LEFT_OVER.fullmatch(path.name) and not is_real_folder(path):
                path.unlink(missing_ok=True)
