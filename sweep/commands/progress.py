"""Progress with rate and ETA: a live bar on a terminal, a line now and then elsewhere."""

from __future__ import annotations

import sys
import time
from types import TracebackType

_EVERY_S = 10.0
_TELLING_SHARE, _TELLING_S = 0.01, 60.0
"""No time left is told before this share of a phase is done, or this time has passed: the first jobs are often small,
and wait for code that is being compiled."""


class ProgressDisplay:
    """Shows `update(phase, done, total)` calls on stderr."""

    def __init__(self, *, quiet: bool = False) -> None:
        self._quiet = quiet
        self._live = sys.stderr.isatty() and not quiet
        self._phase = ""
        self._started = 0.0
        self._first = 0
        self._last_line = 0.0

    def __enter__(self) -> ProgressDisplay:
        if self._live:
            from rich.console import Console  # noqa: PLC0415  (only on a terminal)
            from rich.progress import (  # noqa: PLC0415
                BarColumn,
                MofNCompleteColumn,
                TextColumn,
                TimeRemainingColumn,
            )
            from rich.progress import Progress as Bars  # noqa: PLC0415

            columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
            self._bars = Bars(*columns, console=Console(stderr=True))
            self._bars.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._live:
            self._bars.stop()

    def update(self, phase: str, done: int, total: int) -> None:
        """Show that `done` of `total` are done in a phase."""
        now = time.monotonic()
        new = phase != self._phase
        if new:
            self._phase, self._started, self._first, self._last_line = phase, now, done, now
        if self._live:
            if new:
                self._task = self._bars.add_task(phase, total=total)
            self._bars.update(self._task, completed=done)
        elif not self._quiet and now - self._last_line >= _EVERY_S:
            self._last_line = now
            print(f"{phase}: {done:,} of {total:,}, {self._pace(now, done, total)}", file=sys.stderr, flush=True)

    def _pace(self, now: float, done: int, total: int) -> str:
        """The rate and the time left, where what is done says something of what is left."""
        elapsed, new = now - self._started, done - self._first
        if new <= 0 or (new < _TELLING_SHARE * total and elapsed < _TELLING_S):
            return "time left not known yet"
        rate = new / max(elapsed, 1e-9)
        return f"{rate:,.3g}/s, {(total - done) / rate:.0f} s left"
