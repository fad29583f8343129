"""What each worker process sets for itself."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache, partial

from joblib.externals.loky import process_executor

from ..base.garbage import collect_rarely

_PR_SET_PDEATHSIG = 1
"""Number of prctl's option in Linux's sys/prctl.h."""
_KEPT_BYTES, _LARGE_BYTES = 2**26, 2**24
_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3
"""Numbers of mallopt's options in glibc's malloc.h."""
_LEAST_GROWTH_BYTES, _MOST_GROWTH_BYTES = 300_000_000, 2**30
"""loky's own limit of what a worker may grow after its first call, and ours."""
_OF_MEMORY = 0.25


@cache
def preparing(parent_pid: int) -> Callable[[], None]:
    """What each worker of a process calls first; the same object each time, by which a pool knows its workers."""
    return partial(prepare_worker, parent_pid)


def prepare_worker(parent_pid: int) -> None:
    """Leave signals to the parent, end with it, keep caches and freed memory, and look for garbage rarely."""
    leave_signals_to_the_parent()
    end_with(parent_pid)
    keep_caches()
    keep_freed_memory()
    collect_rarely()


def leave_signals_to_the_parent() -> None:
    """In a worker: a Ctrl-C reaches the whole process group, and the parent alone decides what becomes of the work."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def end_with(parent_pid: int) -> None:
    """In a worker: when its parent is killed, end at once, where the system can do that (Linux)."""
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent_pid:  # it was killed before
            os._exit(1)


def keep_caches() -> None:
    """Let this worker grow by more than loky's 300 MB before it is taken for one that leaks, and started anew.

    What the libraries and caches of a run hold is bounded, but more than that. A worker that was started anew would
    load and make it all again, and would grow as much. loky looks at memory only where psutil is installed.
    """
    process_executor._MAX_MEMORY_LEAK_SIZE = growth_bytes(os.cpu_count() or 1)


def growth_bytes(workers: int) -> int:
    """What each worker may grow: 1 GiB where a quarter of the memory suffices for all of them, never less than loky's
    own limit.
    """
    memory = 0
    with suppress(OSError, ValueError, AttributeError):
        memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    return max(_LEAST_GROWTH_BYTES, min(_MOST_GROWTH_BYTES, int(_OF_MEMORY * memory / workers)))


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
