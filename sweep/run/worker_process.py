"""What each worker process sets for itself."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache, partial

_PR_SET_PDEATHSIG = 1
"""Number of prctl's option in Linux's sys/prctl.h."""
_KEPT_BYTES, _LARGE_BYTES = 2**26, 2**24
_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3
"""Numbers of mallopt's options in glibc's malloc.h."""


@cache
def preparing(parent_pid: int) -> Callable[[], None]:
    """What each worker of a process calls first; the same object each time, by which a pool knows its workers."""
    return partial(prepare_worker, parent_pid)


def prepare_worker(parent_pid: int) -> None:
    """Leave signals to the parent, end with it, and keep freed memory."""
    leave_signals_to_the_parent()
    end_with(parent_pid)
    keep_freed_memory()


def leave_signals_to_the_parent() -> None:
    """In a worker: a Ctrl-C reaches the whole process group, and the parent alone decides what becomes of the work."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def end_with(parent_pid: int) -> None:
    """In a worker: when its parent is killed, end at once, where the system can do that (Linux)."""
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent_pid:  # it was killed before
            os._exit(1)


def give_back_freed_memory() -> None:
    """Give the system back what is free, where the C library is glibc, and what Arrow keeps: other work follows."""
    if "pyarrow" in sys.modules:
        sys.modules["pyarrow"].default_memory_pool().release_unused()
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).malloc_trim(0)


def keep_freed_memory() -> None:
    """Keep up to 64 MiB that were freed for the next block of designs, where the C library is glibc.

    By default it gives every block's arrays back to the system, and the next block pays for new pages. Arrays above
    16 MiB still go back at once.
    """
    with suppress(OSError, AttributeError, TypeError):
        libc = ctypes.CDLL(None)
        libc.mallopt(_M_TRIM_THRESHOLD, _KEPT_BYTES)
        libc.mallopt(_M_MMAP_THRESHOLD, _LARGE_BYTES)
