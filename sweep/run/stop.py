"""Stop a run at a signal within seconds, without losing what is finished."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from types import FrameType, TracebackType

from ..base.errors import InterruptedRunError

SIGNALS = (signal.SIGINT, signal.SIGTERM)
GRACE_S = 2.0
"""What is computed when a stop is asked for may still be finished for so long."""
_KNOCK_S, _AGAIN_S, _LAST_S = 0.05, 3.0, 4.5
POOL_THREAD = "ExecutorManagerThread"
"""Name of the thread in which loky hands out work."""
_SAID = "interrupted; finished chunks are kept, the same command continues"


class BrokenOffError(KeyboardInterrupt):
    """Raised in the main thread, wherever it is, when a stop was asked for and nothing has to be finished first."""


@dataclass
class Stop:
    """Whether a signal asked the run to stop, and whether its main thread may be broken off where it is.

    It may, but while it is `held`, and not before the end of a `grace`. `ends_process`: a call into a library that
    does not come back is ended with the process.
    """

    requested: bool = False
    ends_process: bool = False
    _since: float = 0.0
    _broken_off: float | None = None
    _knocked: bool = False
    _handled: bool = False
    _impatient: bool = False
    _held: int = 0
    _grace_s: float = 0.0
    _over: threading.Event = field(default_factory=threading.Event)
    _sending: threading.Lock = field(default_factory=threading.Lock)

    @contextmanager
    def held(self) -> Iterator[None]:
        """What must be whole, such as an entry of the journal."""
        self._held += 1
        try:
            yield
        finally:
            self._held -= 1

    @contextmanager
    def grace(self) -> Iterator[None]:
        """What may be finished when it takes no longer than GRACE_S."""
        self._grace_s = GRACE_S
        try:
            yield
        finally:
            self._grace_s = 0.0

    def check(self) -> None:
        """Raise InterruptedRunError when a stop was asked for; nothing has to be broken off then."""
        if self.requested:
            self._broken_off = time.monotonic()
            raise InterruptedRunError(_SAID)

    def _asked(self, _number: int, _frame: FrameType | None) -> None:
        """A signal: the first one asks; `watch` sends it again when it is time; another one ends the grace."""
        self._impatient = self._impatient or (self.requested and not self._knocked and self._handled)
        self._knocked, self._handled = False, True
        self._request()
        if self._may_break(now := time.monotonic()):
            self._broken_off = now
            raise BrokenOffError

    def _request(self) -> None:
        if not self.requested:
            self.requested, self._since = True, time.monotonic()

    def _may_break(self, now: float) -> bool:
        """Once; and once more where someone swallowed the exception."""
        grace_s = 0.0 if self._impatient else self._grace_s
        if self._held or self._over.is_set() or now < self._since + grace_s:
            return False
        return self._broken_off is None or now > self._broken_off + _AGAIN_S

    def again(self) -> None:
        """The exception was swallowed: the next knock may raise it once more."""
        self._broken_off = None

    def watch(self, signals: int, main_thread: int) -> None:
        """In a thread of its own: interrupt the main thread as soon as it may be broken off.

        `signals`: a pipe from the C library's handler, since Python's runs only between two byte codes of the main
        thread, and that may be far away in a library.
        """
        while not self._over.is_set() and os.read(signals, 1)[0] not in SIGNALS:
            pass  # another signal of the process, or the end
        while not self._over.wait(_KNOCK_S):
            self._request()
            now = time.monotonic()
            if self.ends_process and now > self._since + _LAST_S and not self._held:
                os.write(2, f"sweep: {_SAID}\n".encode())
                os._exit(InterruptedRunError.exit_code)
            with self._sending:
                if self._may_break(now):
                    self._knocked = True
                    signal.pthread_kill(main_thread, SIGNALS[0])


@contextmanager
def stop_on_signals(outer: Stop | None = None, *, ends_process: bool = False) -> Iterator[Stop]:
    """SIGINT and SIGTERM ask for a stop: no more work is handed out, and what takes longer than a moment is broken off.

    Raises InterruptedRunError then. With `outer`, whoever made that takes the signals. Outside the main thread, where
    Python takes no signals, nothing is changed.
    """
    if outer is not None:
        yield outer
        return
    stop = Stop(ends_process=ends_process)
    if threading.current_thread() is not threading.main_thread():
        yield stop
        return
    signals, at_once = os.pipe()
    os.set_blocking(at_once, False)
    watcher = threading.Thread(target=stop.watch, args=(signals, threading.get_ident()), daemon=True)
    watcher.start()
    give_back = _news_of(stop)
    earlier = signal.set_wakeup_fd(at_once, warn_on_full_buffer=False)
    before = [(number, signal.signal(number, stop._asked)) for number in SIGNALS]
    try:
        yield stop
    except BrokenOffError:
        raise InterruptedRunError(_SAID) from None
    finally:
        stop._over.set()
        give_back()
        with stop._sending:
            for number, handler in before:
                signal.signal(number, handler)
        signal.set_wakeup_fd(earlier)
        os.write(at_once, b"\0")
        watcher.join()
        os.close(signals)
        os.close(at_once)


def _news_of(stop: Stop) -> Callable[[], None]:
    """Nobody is told of what a stop has caused; what gives the usual hooks back.

    In a pool's thread: that the workers are gone, or that calls are lost to it, as they may be where an error ends it.
    In compiled code that can't hand an exception on, which Cython and Python print and forget: that it was broken off;
    the main thread is broken off once more then.
    """
    in_threads, printed, ignored = threading.excepthook, sys.excepthook, sys.unraisablehook

    def in_thread(fault: threading.ExceptHookArgs) -> None:
        of_pool = fault.thread is not None and fault.thread.name == POOL_THREAD
        if not (of_pool and (stop.requested or issubclass(fault.exc_type, KeyError))):
            in_threads(fault)

    def print_(kind: type[BaseException], fault: BaseException, trace: TracebackType | None) -> None:
        if not issubclass(kind, BrokenOffError):
            printed(kind, fault, trace)

    def ignore(fault: sys.UnraisableHookArgs) -> None:
        if issubclass(fault.exc_type, BrokenOffError):
            stop.again()
        else:
            ignored(fault)

    threading.excepthook, sys.excepthook, sys.unraisablehook = in_thread, print_, ignore

    def give_back() -> None:
        sys.excepthook, sys.unraisablehook = printed, ignored
        if not stop.requested:  # else the process ends, and the pool's thread may end after this
            threading.excepthook = in_threads

    return give_back


@contextmanager
def without_interrupts() -> Iterator[None]:
    """Processes that are started in the block never see a Ctrl-C, from their first moment on."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
