"""A cache that threads share."""

from __future__ import annotations

import os
import threading
import weakref
from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Any, Generic, TypeVar

_Key = TypeVar("_Key", bound=Hashable)
_Value = TypeVar("_Value")

_all: weakref.WeakSet[Cache[Any, Any]] = weakref.WeakSet()


class Cache(Generic[_Key, _Value]):
    """The values that were used last, at most `most` of them, shared by threads.

    Threads wait for one another, so that each value is made once; failures are not kept.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._values: OrderedDict[_Key, _Value] = OrderedDict()
        self._lock = threading.RLock()
        _all.add(self)

    def __len__(self) -> int:
        return len(self._values)

    def get(self, key: _Key, make: Callable[[], _Value]) -> _Value:
        """Return the value of `key`, computed by `make` when it is not cached."""
        with self._lock:
            if key not in self._values:
                self._values[key] = make()
                while len(self._values) > self._most:
                    self._values.popitem(last=False)
            self._values.move_to_end(key)
            return self._values[key]


def _after_fork() -> None:
    """Give a forked process locks of its own: a thread that it has not may have held those of its parent."""
    for cache in _all:
        cache._lock = threading.RLock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)
