"""Lock: one command at a time writes into a run's folder."""

from __future__ import annotations

import errno
import os
import re
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from filelock import BaseFileLock, FileLock, SoftFileLock, Timeout

from ..base.disk import is_real_folder, opened, read_plain
from ..base.errors import OutputError, ValidationIssue
from .answers import ANSWERS
from .atomic import LEFT_OVER
from .tables import RESULTS

LOCK = ".lock"
OWNER = ".lock-owner"
"""Its name on disks without flock."""
_NO_FLOCK = {errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOLCK}
_MARKER = re.compile(rb"\d+\n[^\n]+\n(\d*\n?)")
_MOST_BYTES = 4096
_WAIT_S = 0.2
"""Someone may just be looking whether the folder is in use."""


@contextmanager
def locked(output: Path) -> Iterator[None]:
    """Hold the output folder for one command.

    The system releases the lock with its process; where it cannot, the next command on the same host does. Hidden files
    of killed commands and workers are removed.

    Raises OutputError if it is in use or cannot be written.
    """
    try:
        output.mkdir(parents=True, exist_ok=True)
        if os.path.lexists(output / LOCK) and not _is_lock(output / LOCK):
            raise OutputError(ValidationIssue("file not created by sweep; move it", str(output / LOCK)))
        lock = _acquired(output, _WAIT_S)
    except Timeout:
        raise OutputError(ValidationIssue("in use by another command", str(output))) from None
    except OSError as error:
        raise OutputError(ValidationIssue(f"cannot be written: {error.strerror or error}", str(output))) from None
    try:
        clear(output)
        yield
    finally:
        with suppress(OSError):
            clear(output)
        lock.release()


def _acquired(output: Path, wait_s: float) -> BaseFileLock:
    """Return the held lock of a folder: of the system, or where the disk has none a file that names host and process.

    That file gives way when its process on this host is gone.
    """
    lock: BaseFileLock = FileLock(output / LOCK, fallback_to_soft=False)
    try:
        lock.acquire(timeout=wait_s)
    except (OSError, NotImplementedError) as error:
        if isinstance(error, OSError) and error.errno not in _NO_FLOCK:
            raise
        lock = SoftFileLock(output / OWNER)
        lock.acquire(timeout=wait_s)
    return lock


def _is_lock(path: Path) -> bool:
    """Return whether a file is empty, or names a process and its host."""
    status = path.lstat()
    if not stat.S_ISREG(status.st_mode) or status.st_size > _MOST_BYTES:
        return False
    return not status.st_size or _MARKER.fullmatch(read_plain(path, _MOST_BYTES)) is not None


def in_use(output: Path) -> bool:
    """Return whether a command holds the folder."""
    if not (output / LOCK).is_file() and not (output / OWNER).is_file():
        return False
    try:
        _acquired(output, 0).release()
    except Timeout:
        return True
    except OSError:  # a disk or an owner that lets nobody write: whoever holds it is asked otherwise
        return _is_held(output / LOCK)
    return False


def _is_held(path: Path) -> bool:
    """Return whether a process holds the lock of a file that may only be read."""
    try:
        import fcntl  # noqa: PLC0415  (not on Windows)

        with opened(path) as file:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except (OSError, ImportError):
        return False
    return False


def clear(output: Path) -> None:
    """Remove half-written files of killed commands and workers, but not through links."""
    inner = (output / RESULTS, output / ANSWERS)
    for folder in (output, *(inner_folder for inner_folder in inner if is_real_folder(inner_folder))):
        for path in folder.iterdir():
            if re.fullmatch(LEFT_OVER, path.name) and not is_real_folder(path):
                path.unlink(missing_ok=True)
