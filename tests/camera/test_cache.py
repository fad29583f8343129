"""Caches that threads share: every value is made once, and no thread misses one that another has thrown out."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor

import pytest

from sweep.base.cache import Cache

N_THREADS = 8


@pytest.fixture(autouse=True)
def often_switched() -> Iterator[None]:
    """Threads take turns every few microseconds."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(before)


def at_once(work: Callable[[int], None]) -> None:
    """Run `work(number)` in many threads that begin together; raises what one of them raises."""
    begin = threading.Barrier(N_THREADS)

    def waits(number: int) -> None:
        begin.wait()
        work(number)

    with ThreadPoolExecutor(N_THREADS) as threads:
        for done in [threads.submit(waits, number) for number in range(N_THREADS)]:
            done.result(timeout=120)


def test_the_values_that_were_used_last_are_kept() -> None:
    made: list[int] = []

    def value(key: int) -> int:
        return cache.get(key, lambda: made.append(key) or -key)  # type: ignore[func-returns-value]

    cache: Cache[int, int] = Cache(2)
    assert [value(key) for key in (1, 2, 1, 3, 1, 2)] == [-1, -2, -1, -3, -1, -2]
    assert made == [1, 2, 3, 2]  # 2 was thrown out by 3, since 1 was used after it
    assert len(cache) == 2


def test_failed_cache_entries_are_made_again() -> None:
    cache: Cache[str, float] = Cache(2)
    with pytest.raises(ZeroDivisionError):
        cache.get("a", lambda: 1 / 0)
    assert cache.get("a", lambda: 1.0) == 1.0


def test_threads_make_a_value_once_and_always_get_one() -> None:
    cache: Cache[int, int] = Cache(2)  # fewer than the keys, so that values are thrown out all the time
    making: list[int] = []

    def made(key: int) -> int:
        making.append(key)
        assert len(making) == 1  # by one thread at a time
        making.pop()
        return key * key

    def work(number: int) -> None:
        for turn in range(2000):
            key = (turn * (number + 1)) % 5
            assert cache.get(key, lambda k=key: made(k)) == key * key  # type: ignore[misc]

    at_once(work)
    assert len(cache) == 2
