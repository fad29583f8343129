"""Calls on worker processes, threads or a cluster, by joblib; deaths of workers; stopping a run."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import tempfile
import threading
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import Any

import joblib
import psutil
from joblib.externals.loky.backend import resource_tracker
from threadpoolctl import threadpool_limits

from ..base.errors import InterruptedRunError, SweepError, ValidationIssue
from ..base.types import Call, Parallel, Progress

BACKENDS = ("loky", "threading", "dask")
_LIBRARIES = ("numba", "matplotlib.figure", "sweep.runs.search")
"""What calls of workers load."""
STOPPING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
"""Signals that stop a run; Windows has no SIGHUP."""
_stop = threading.Event()
"""A stop was asked for. Compiled libraries may swallow the exception by which the signal's handler says so, or raise
another one in its place, as if a design had failed."""
_STOPPED = "interrupted; finished parts are kept, the same command continues"


class WorkerKilledError(SweepError):
    """Error of a call whose worker died twice."""


@dataclass(frozen=True)
class Held:
    """Value that many calls share; `path`: file in which worker processes find it, None where calls carry it."""

    value: Any
    path: Path | None

    def __reduce__(self) -> tuple[Any, ...]:
        return (Held, (self.value, None)) if self.path is None else (_held, (self.path,))


@lru_cache(maxsize=2)
def _held(path: Path) -> Held:
    return Held(pickle.loads(path.read_bytes()), path)


@dataclass(frozen=True)
class Workers:
    """Workers of a backend, each with one thread for its libraries.

    `n_jobs`: workers on this machine, at most one for each core; those of a cluster are used as they are.
    """

    n_jobs: int
    backend: str = "loky"

    def hold(self, value: Any, folder: Path) -> Held:
        """Return a value that calls may name: worker processes on this machine read it once each, from a file.

        The file lies in the locked folder of a run, and goes with the lock, or with that of the next run.
        """
        if self.backend != "loky":
            return Held(value, None)
        try:
            with tempfile.NamedTemporaryFile(dir=folder, prefix=f".tmp-{os.getpid()}-", delete=False) as file:
                pickle.dump(value, file)
        except OSError as error:
            raise SweepError(ValidationIssue(f"cannot be written: {error.strerror or error}", str(folder))) from None
        return Held(value, Path(file.name))

    @property
    def count(self) -> int:
        """Workers on this machine."""
        return max(1, min(self.n_jobs, os.cpu_count() or 1))

    def __call__(self, calls: Iterable[Call], killed: Callable[[Call], Any] | None = None) -> Iterator[Any]:
        """Yield the results of calls in order; see `unordered`."""
        early: dict[int, Any] = {}
        turn = 0
        for at, result in self.unordered(calls, killed):
            early[at] = result
            while turn in early:
                yield early.pop(turn)
                turn += 1

    def unordered(
        self, calls: Iterable[Call], killed: Callable[[Call], Any] | None = None
    ) -> Iterator[tuple[int, Any]]:
        """Yield the numbers and results of calls as they come.

        If a worker dies, the calls under way run again, one at a time. One that kills its worker again goes to
        `killed`.

        Raises WorkerKilledError: without `killed`.
        """
        waiting = dict(enumerate(calls))
        n_jobs = -1 if self.backend == "dask" else self.count
        while waiting:
            begun: dict[int, Call] = {}

            def dispatched(begun: dict[int, Call] = begun) -> Iterator[Call]:
                for at, call in list(waiting.items()):
                    begun[at] = call
                    yield (_numbered, (at, call), {})

            parallel = joblib.Parallel(n_jobs, return_as="generator_unordered", batch_size=1, pre_dispatch="2*n_jobs")
            try:
                for at, result in parallel(dispatched()):
                    raise_if_stopped()
                    del waiting[at], begun[at]
                    yield at, result
            except Exception as error:
                if not _is_death(error):
                    raise
                for at, call in begun.items():
                    try:
                        result = self.alone(call)
                    except WorkerKilledError:
                        if killed is None:
                            raise
                        result = killed(call)
                    del waiting[at]
                    yield at, result

    def alone(self, call: Call) -> Any:
        """Return the result of a call with no other under way.

        Raises WorkerKilledError if its worker dies.
        """
        try:
            ((_, result),) = joblib.Parallel(max(2, self.count))([(_numbered, (0, call), {})])
        except Exception as error:
            if not _is_death(error):
                raise
            raise WorkerKilledError("a worker died twice at the same work: out of memory, or killed") from None
        return result


@contextmanager
def workers(n_jobs: int, backend: str = "loky", scheduler: str | None = None) -> Iterator[Workers]:
    """Start a backend and give its workers within a `with` block.

    Raises SweepError if Dask is not installed, or its scheduler does not answer.
    """
    settings: dict[str, Any] = {}
    backend = backend_here(backend)
    # These filters stay: joblib may warn of cancelled calls after a stop has left the block.
    warnings.filterwarnings("ignore", message=".*have been cancelled", category=UserWarning)
    warnings.filterwarnings("ignore", message="A worker stopped while some jobs", category=UserWarning)
    with ExitStack() as stack:
        if backend == "dask":
            stack.enter_context(_client(scheduler))
        elif backend == "loky":
            _start_quiet_tracker()
            settings = {"inner_max_num_threads": 1, "initializer": _begin_worker, "initargs": (os.getpid(),)}
            settings["max_nbytes"] = None  # arrays go with their calls: no files that a killed run would leave
        stack.enter_context(threadpool_limits(limits=1))  # with one worker, and with threads, this process computes
        stack.enter_context(joblib.parallel_config(backend, **settings))
        yield Workers(n_jobs, backend)


def backend_here(backend: str) -> str:
    """Return the backend, or threads in the place of processes where this machine has no semaphores for these."""
    if backend != "loky":
        return backend
    try:
        multiprocessing.Lock()
    except (OSError, ImportError):  # /dev/shm is missing or full, or nobody may write there
        return "threading"
    return backend


def _start_quiet_tracker() -> None:
    """Start the process that removes joblib's semaphores; warnings of what a stopped run left are ignored."""
    before = os.environ.get("PYTHONWARNINGS")
    os.environ["PYTHONWARNINGS"] = ",".join(filter(None, (before, "ignore:resource_tracker:UserWarning")))
    try:
        resource_tracker.ensure_running()
    finally:
        if before is None:
            del os.environ["PYTHONWARNINGS"]
        else:
            os.environ["PYTHONWARNINGS"] = before


def run_with_progress(parallel: Parallel, calls: Sequence[Call], phase: str, progress: Progress) -> Iterator[Any]:
    """Run calls on the cores and yield their answers in order, with the progress of a phase."""
    for done, answer in enumerate(parallel(calls), 1):
        progress(phase, done, len(calls))
        yield answer


@contextmanager
def stopped_by_signals() -> Iterator[None]:
    """Let SIGTERM, and a terminal that closes, stop a run as Ctrl-C does, within a `with` block.

    joblib ends its workers when the exception reaches it; finished parts are on the disk. Python handles signals in
    the main thread alone; elsewhere nothing changes.

    Raises InterruptedRunError: after SIGINT or SIGTERM.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in STOPPING}
    for number, handler in before.items():
        if handler is not signal.SIG_IGN:  # as a shell sets it for background jobs
            signal.signal(number, _ask_to_stop)
    try:
        yield
    except KeyboardInterrupt:
        raise InterruptedRunError(_STOPPED) from None
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        _stop.clear()


def raise_if_stopped() -> None:
    """Raise KeyboardInterrupt if a stop was requested, before a result is kept that it may have spoiled."""
    if _stop.is_set():
        raise KeyboardInterrupt


def _ask_to_stop(*_: object) -> None:
    _stop.set()
    raise KeyboardInterrupt


def _begin_worker(parent: int) -> None:
    """Ignore Ctrl-C and the end of a terminal in a worker, and end the worker with its parent.

    Libraries are loaded here, as loky replaces a worker that grows by 300 MB after its first call.
    """
    for number in set(STOPPING) - {signal.SIGTERM}:
        signal.signal(number, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    for library in _LIBRARIES:
        import_module(library)


def _end_with(parent: int) -> None:
    """End this process with its parent; loky's workers would wait for work forever."""
    with suppress(psutil.NoSuchProcess):
        psutil.Process(parent).wait()
    signal.raise_signal(signal.SIGTERM)


def _numbered(at: int, call: Call) -> tuple[int, Any]:
    """Return number and result of a call whose libraries use one thread, so that sums do not depend on the workers."""
    function, arguments, named = call
    with threadpool_limits(limits=1):
        return at, function(*arguments, **named)


def _is_death(error: Exception) -> bool:
    """Return whether a worker died: loky's broken pool, or Dask's KilledWorker."""
    return isinstance(error, BrokenProcessPool) or type(error).__name__ == "KilledWorker"


def _client(scheduler: str | None) -> Any:
    """Return a client of a Dask scheduler."""
    if scheduler is None:
        raise SweepError("--backend dask needs --scheduler tcp://HOST:PORT")
    try:
        from distributed import Client  # noqa: PLC0415  (an extra)
    except ImportError:
        raise SweepError("--backend dask needs Dask: pip install 'cfa-sweep[dask]'") from None
    try:
        return Client(scheduler, timeout="10s", set_as_default=True)  # type: ignore[no-untyped-call]
    except (OSError, ValueError, TypeError) as error:
        raise SweepError(f"--scheduler {scheduler}: {str(error).splitlines()[0]}") from None
