"""Calls over worker processes, threads or a cluster: results in order, whatever becomes of the workers."""

from __future__ import annotations

import os
import sys
import time
import warnings
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from functools import lru_cache
from importlib import import_module
from itertools import islice
from multiprocessing import get_context
from typing import TYPE_CHECKING, Any

import joblib
from joblib.externals.loky import ProcessPoolExecutor
from threadpoolctl import ThreadpoolController

from ..base.errors import SweepError
from ..base.types import Call
from .cluster import client_of
from .stop import Stop, without_interrupts
from .worker_process import give_back_freed_memory, keep_freed_memory, preparing

if TYPE_CHECKING:
    from ..study import Study

_LEAST_WINDOW, _WINDOW_PER_WORKER = 64, 16
_HANDED_OUT_S = 0.1
"""Seconds for a pool's thread to hand on what it was given; it needs far less, unless the machine stands still."""
_CALLED, _SEARCHING = ("sweep.run.sweep", "sweep.metrics.nearest"), "sweep.search.solver"
BACKENDS = ("loky", "threading", "dask")
_Numbered = tuple[int, Call]


class WorkerKilledError(SweepError):
    """A call whose worker died twice."""


@dataclass(frozen=True)
class Workers:
    """How many workers of which kind; never more than the cores, each with one thread for its libraries.

    `scheduler`: address of a Dask scheduler, whose workers are used as they are.
    """

    n_jobs: int
    stop: Stop
    backend: str = "loky"
    scheduler: str | None = None
    _starting: list[Generator[Any]] = field(default_factory=list, init=False, repr=False, compare=False)

    def begin(self, modules: Iterable[str]) -> None:
        """Start worker processes, which load some modules of the package while this process does something else.

        Their first call waits for them, as it would without it.
        """
        if self.backend == "loky" and self.count > 1:
            names = tuple(modules)
            parallel = joblib.Parallel(self.count, return_as="generator_unordered", batch_size=1)
            with self.stop.held(), without_interrupts():
                self._starting.append(parallel((_loaded, (names,), {}) for _ in range(self.count)))

    def begun(self) -> None:
        """Wait for processes that were started; one that died meanwhile is started again when it is needed."""
        try:
            while self._starting:
                for _ in self._gracefully(self._starting[-1]):
                    pass
                self._starting.pop()
        except Exception as error:
            if not _is_death(error):
                raise
            self._starting.clear()

    def not_awaited(self) -> None:
        """End what was started and is not awaited, as after an error or a stop."""
        for started in self._starting:
            _left(started)
        self._starting.clear()

    @property
    def count(self) -> int:
        """Workers on this machine."""
        return max(1, min(self.n_jobs, os.cpu_count() or 1))

    def __call__(
        self,
        calls: Iterable[Call],
        killed: Callable[[Call], Any] | None = None,
        finished: Callable[[int, Any], None] | None = None,
    ) -> Generator[Any]:
        """Results of delayed calls in their order; `finished` gets each with its number as soon as it is there.

        When a worker dies, the calls under way run again, each in a process of its own. One that dies again goes to
        `killed`, whose answer counts as its result; without it, WorkerKilledError is raised. Raises
        InterruptedRunError after a stop was asked for and what came within its grace has been handed out. A result
        that was handed out may be kept in peace: the stop waits until the next one is asked for.
        """
        self.begun()
        rest = enumerate(calls)
        early: dict[int, Any] = {}
        turn = 0
        # joblib goes on computing while results wait to be taken; a window bounds how many can wait.
        window = max(_LEAST_WINDOW, _WINDOW_PER_WORKER * joblib.effective_n_jobs(self._n_jobs))
        while not self.stop.requested and (some := list(islice(rest, window))):
            for at, result in self._window(deque(some), killed):
                with self.stop.held():
                    if finished is not None:
                        finished(at, result)
                    early[at] = result
                    while turn in early:
                        yield early.pop(turn)
                        turn += 1
        self.stop.check()

    def _window(self, waiting: deque[_Numbered], killed: Callable[[Call], Any] | None) -> Iterator[tuple[int, Any]]:
        """Results of a few calls with their numbers, as they come; those that a stop leaves behind are left out."""
        flying: dict[int, Call] = {}

        def taken() -> Iterator[Call]:
            while waiting and not self.stop.requested:
                at, call = waiting.popleft()
                flying[at] = call
                yield (_numbered, (at, call), {})

        while waiting and not self.stop.requested:
            results: Generator[Any] | None = None
            try:
                parallel = joblib.Parallel(self._n_jobs, return_as="generator_unordered", pre_dispatch="3*n_jobs")
                with self.stop.held(), without_interrupts():
                    results = parallel(taken())
                for at, result in self._gracefully(results):
                    del flying[at]
                    yield at, result
            except Exception as error:
                if not _is_death(error):
                    raise
            except BaseException:  # whoever took the results left, or was broken off
                waiting.clear()
                if flying and results is not None:
                    _left(results)
                raise
            suspects = list(flying.items())
            flying.clear()
            for at, call in suspects:
                if self.stop.requested:  # it may have ended the workers, too
                    return
                with self.stop.grace():
                    result = self._again(call, killed)
                yield at, result

    def _gracefully(self, results: Iterator[Any]) -> Iterator[Any]:
        """The same results; each is waited for as long as a stop allows."""
        while True:
            with self.stop.grace():
                result = next(results, None)
            if result is None:
                return
            yield result

    @property
    def _n_jobs(self) -> int:
        return -1 if self.backend == "dask" else self.count

    @staticmethod
    def _again(call: Call, killed: Callable[[Call], Any] | None) -> Any:
        try:
            return alone(call)
        except WorkerKilledError:
            if killed is None:
                raise
            return killed(call)


def called_by(study: Study) -> tuple[str, ...]:
    """Modules whose functions a run of the study calls in its workers."""
    return _CALLED if study.search is None else (*_CALLED, _SEARCHING)


def usable_backend(backend: str) -> str:
    """The backend; threads, where this machine has no semaphores for worker processes (no or a read-only /dev/shm)."""
    if backend != "loky":
        return backend
    try:
        get_context("fork").Semaphore()
    except (ImportError, OSError):
        return "threading"
    return backend


@contextmanager
def workers(how: Workers) -> Iterator[Workers]:
    """Start the backend and give the workers for as long as the block stands.

    Raises SweepError when Dask is not installed or its scheduler does not answer.
    """
    how = replace(how, backend=usable_backend(how.backend))
    settings: dict[str, Any] = {}
    keep_freed_memory()  # with one worker, and with threads, the work is done in this process
    with ExitStack() as stack:
        stack.enter_context(warnings.catch_warnings())
        # A run that ends early cancels what it has no use for.
        warnings.filterwarnings("ignore", message=".*have been cancelled", category=UserWarning)
        # loky starts a worker anew whose caches have grown, and hands it the calls again.
        warnings.filterwarnings("ignore", message="A worker stopped while some jobs", category=UserWarning)
        if how.backend == "dask":
            stack.enter_context(client_of(how.scheduler))
        elif how.backend == "loky":
            settings = {"inner_max_num_threads": 1, "initializer": preparing(os.getpid())}
        # This process computes, too; and a thread that ends gives back what it found, also to those beside it.
        stack.enter_context(one_thread())
        stack.enter_context(joblib.parallel_config(how.backend, **settings))
        stack.callback(how.not_awaited)
        yield how
        how.begun()


def alone(call: Call) -> Any:
    """Result of a call in a process of its own; raises WorkerKilledError when that dies."""
    process = ProcessPoolExecutor(max_workers=1, initializer=preparing(os.getpid()))
    ended = False
    try:
        with without_interrupts():
            coming = process.submit(_one_threaded, *call)
        result = coming.result()
        ended = True
        return result
    except BrokenProcessPool:
        raise WorkerKilledError("a worker died twice at the same work: out of memory, or killed") from None
    finally:
        process.shutdown(kill_workers=not ended)


@lru_cache(maxsize=1)
def _libraries(_n_modules: int) -> ThreadpoolController:
    """Libraries of this process that have threads. They are looked for again where modules were imported since."""
    return ThreadpoolController()


def one_thread() -> AbstractContextManager[Any]:
    """While this is open, libraries use one thread."""
    limits: AbstractContextManager[Any] = _libraries(len(sys.modules)).limit(limits=1)
    return limits


def _one_threaded(function: Callable[..., Any], arguments: tuple[Any, ...], named: dict[str, Any]) -> Any:
    """A call whose libraries use one thread: the same sums in the same order with any number of workers."""
    with one_thread():
        return function(*arguments, **named)


def _loaded(modules: tuple[str, ...]) -> bool:
    """Load modules of the package, for other work than before."""
    give_back_freed_memory()
    for name in modules:
        import_module(name)
    return True


def _numbered(at: int, call: Call) -> tuple[int, Any]:
    """The result of a call, and its number."""
    return at, _one_threaded(*call)


def _left(results: Generator[Any]) -> None:
    """End calls whose results nobody waits for, and whose workers get no more.

    The pool's thread hands calls out within moments. A call that it has not handed out yet when its workers are ended
    is lost to it: a KeyError in that thread, and semaphores that nobody frees.
    """
    time.sleep(_HANDED_OUT_S)
    results.close()


def _is_death(error: Exception) -> bool:
    """Whether a worker died, as the backends say it: loky's broken pool, or Dask's KilledWorker."""
    return isinstance(error, BrokenProcessPool) or type(error).__name__ == "KilledWorker"
