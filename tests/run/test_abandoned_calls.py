"""Calls whose results nobody waits for, as after an error: their worker processes end, and nothing else is said."""

from __future__ import annotations

import math
import os
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from sweep.base.types import delayed
from sweep.run.stop import POOL_THREAD, Stop, stop_on_signals
from sweep.run.workers import Workers, workers


@pytest.fixture
def faults(monkeypatch: pytest.MonkeyPatch) -> list[threading.ExceptHookArgs]:
    """What threads died of."""
    found: list[threading.ExceptHookArgs] = []
    monkeypatch.setattr(threading, "excepthook", found.append)
    return found


def _pools() -> int:
    return sum(thread.name == POOL_THREAD for thread in threading.enumerate())


def _started_and_left(after_s: float) -> None:
    with workers(Workers(2, Stop())) as crew:
        crew.begin(["math"])
        time.sleep(after_s)
        raise ValueError


def _left_under_way(n_jobs: int, function: Callable[..., Any], *arguments: object) -> None:
    with workers(Workers(n_jobs, Stop())) as crew:
        for at, _ in enumerate(crew(delayed(function, *arguments) for _ in range(1000))):
            if at == 3:
                raise ValueError


def _noted(file: Path) -> bool:
    with file.open("a") as handle:
        handle.write("called\n")
    return True


@pytest.mark.parametrize("after_s", [0.0, 0.0005, 0.02, 0.3])
def test_workers_that_were_started_and_not_needed_end_in_peace(
    faults: list[threading.ExceptHookArgs], after_s: float
) -> None:
    for _ in range(4):
        with pytest.raises(ValueError):  # noqa: PT011  (it says nothing)
            _started_and_left(after_s)
        assert not _pools()
    assert not faults


@pytest.mark.parametrize("size", [1, 5_000_000])
def test_calls_under_way_when_an_error_comes_end_in_peace(faults: list[threading.ExceptHookArgs], size: int) -> None:
    """Also while a large result is on its way, which takes a while."""
    for _ in range(4):
        with pytest.raises(ValueError):  # noqa: PT011  (it says nothing)
            _left_under_way(2, bytes, size)
    assert not faults


def test_nothing_is_computed_any_more_after_an_error(tmp_path: Path) -> None:
    with pytest.raises(ValueError):  # noqa: PT011  (it says nothing)
        _left_under_way(1, _noted, tmp_path / "calls")
    assert (tmp_path / "calls").read_text().count("called") == 4


def test_workers_stay_where_all_results_were_taken() -> None:
    """Whoever takes as many results as there are calls, and no more, leaves nothing behind."""
    seen: set[int] = set()
    with workers(Workers(2, Stop())) as crew:
        for _ in range(5):
            results = crew(delayed(_process_after_a_moment) for _ in range(6))
            seen |= {next(results) for _ in range(6)}
            results.close()  # type: ignore[attr-defined]
    assert len(seen) <= 2


def _process_after_a_moment() -> int:
    time.sleep(0.02)
    return os.getpid()


def test_a_pool_that_was_left_is_followed_by_another() -> None:
    squares = range(20)
    with workers(Workers(2, Stop())) as crew:
        left = crew(delayed(math.sqrt, square) for square in squares)
        next(left)
        left.close()  # type: ignore[attr-defined]
        assert list(crew(delayed(math.sqrt, square) for square in squares)) == [math.sqrt(square) for square in squares]


def test_a_pool_that_loses_calls_to_an_error_is_not_told_of(faults: list[threading.ExceptHookArgs]) -> None:
    """But any other fault of a thread is."""

    def lost(error: Exception) -> None:
        raise error

    with stop_on_signals():
        for name, error in ((POOL_THREAD, KeyError(7)), (POOL_THREAD, OSError()), ("mine", KeyError(7))):
            thread = threading.Thread(target=lost, args=(error,), name=name)
            thread.start()
            thread.join()
    assert [(fault.exc_type, fault.thread and fault.thread.name) for fault in faults] == [
        (OSError, POOL_THREAD),
        (KeyError, "mine"),
    ]
