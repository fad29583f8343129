"""Lock: one command at a time writes into a run's folder."""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from filelock import FileLock, Timeout

from ..base.disk import is_real_folder
from ..base.errors import OutputError, ValidationIssue
from .atomic import LEFT_OVER
from .parts import PARTS
from .tables import FIGURES

LOCK = ".lock"
_WAIT_S = 0.2
"""Someone may just be looking whether the folder is in use."""


@contextmanager
def locked(output: Path) -> Iterator[None]:
    """Hold the output folder for one command.

    The system releases the lock with its process. Hidden files of killed commands and workers are removed.

    Parameters
    ----------
    output : Path
        Output folder.

    Yields
    ------
    None
        The folder is locked.

    Raises
    ------
    OutputError
        If it is in use or cannot be written.
    """
    lock = FileLock(output / LOCK)
    try:
        output.mkdir(parents=True, exist_ok=True)
        if os.path.lexists(output / LOCK) and not _is_lock(output / LOCK):
            raise OutputError(ValidationIssue("is not of this run; move it away", str(output / LOCK)))
        lock.acquire(timeout=_WAIT_S)
    except Timeout:
        raise OutputError(ValidationIssue("in use by another command", str(output))) from None
    except OSError as error:
        raise OutputError(ValidationIssue(f"cannot be written: {error.strerror or error}", str(output))) from None
    try:
        _clear(output)
        yield
    finally:
        with suppress(OSError):
            _clear(output)
        lock.release()


def _is_lock(path: Path) -> bool:
    """Return whether a file is empty."""
    status = path.lstat()
    return stat.S_ISREG(status.st_mode) and not status.st_size


def in_use(output: Path) -> bool:
    """Return whether a command holds the folder.

    Parameters
    ----------
    output : Path
        Output folder.

    Returns
    -------
    bool
        True if it is in use.
    """
    if not (output / LOCK).is_file():
        return False
    try:
        with FileLock(output / LOCK).acquire(timeout=0):
            return False
    except (Timeout, OSError):
        return True


def _clear(output: Path) -> None:
    """Remove half-written files of killed commands and workers, but not through links."""
    inner = (output / PARTS, output / FIGURES)
    for folder in (output, *(one for one in inner if is_real_folder(one))):
        for path in folder.iterdir():
            if re.fullmatch(LEFT_OVER, path.name) and not is_real_folder(path):
                path.unlink(missing_ok=True)
