"""Calls whose results nobody waits for, as after an error: their worker processes end, and nothing else is said."""

from __future__ import annotations

import math
import threading
import time

import pytest

from sweep.base.types import delayed
from sweep.run.stop import POOL_THREAD, Stop
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


def _left_under_way() -> None:
    with workers(Workers(2, Stop())) as crew:
        for root in crew(delayed(math.sqrt, square) for square in range(1000)):
            if root > 3:
                raise ValueError


@pytest.mark.parametrize("after_s", [0.0, 0.0005, 0.02, 0.3])
def test_workers_that_were_started_and_not_needed_end_in_peace(
    faults: list[threading.ExceptHookArgs], after_s: float
) -> None:
    for _ in range(4):
        with pytest.raises(ValueError):  # noqa: PT011  (it says nothing)
            _started_and_left(after_s)
        assert not _pools()
    assert not faults


def test_calls_under_way_when_an_error_comes_end_in_peace(faults: list[threading.ExceptHookArgs]) -> None:
    for _ in range(6):
        with pytest.raises(ValueError):  # noqa: PT011  (it says nothing)
            _left_under_way()
        assert not _pools()
    assert not faults


def test_a_pool_that_was_left_is_followed_by_another() -> None:
    squares = range(20)
    with workers(Workers(2, Stop())) as crew:
        left = crew(delayed(math.sqrt, square) for square in squares)
        next(left)
        left.close()  # type: ignore[attr-defined]
        assert list(crew(delayed(math.sqrt, square) for square in squares)) == [math.sqrt(square) for square in squares]
