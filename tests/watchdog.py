"""A limit on what a test may take: whatever hangs is a failure, not a test that never ends."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


class HangError(Exception):
    """It took longer than the limit."""


@contextmanager
def within(seconds: float) -> Iterator[None]:
    """Raise HangError in what takes longer. The limits are wide: the machine may be busy, and hangs last for minutes."""

    def stop(_signal: int, _frame: FrameType | None) -> None:
        raise HangError(f"more than {seconds:g} s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
