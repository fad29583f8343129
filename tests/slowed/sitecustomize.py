"""In every process of a run: one call of a function, named by SWEEP_SLOW_AT, takes a minute.

SWEEP_SLOW_AT is MODULE:NAME; SWEEP_SLOW_CALL the number of that call, counted in the file SWEEP_SLOW_FILE.
"""

from __future__ import annotations

import functools
import importlib.abc
import importlib.util
import os
import signal
import sys
import time
from pathlib import Path
from typing import Any


def for_a_minute() -> None:
    """In calls of a second each, in which a process takes no signal but hears of it after them."""
    for _ in range(60):
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
        time.sleep(1)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT, signal.SIGTERM})


def slowed(function: Any) -> Any:
    @functools.wraps(function)
    def wrapped(*arguments: Any, **named: Any) -> Any:
        calls = Path(os.environ["SWEEP_SLOW_FILE"])
        with calls.open("ab", buffering=0) as handle:  # where it ends is its number, also if two call at once
            handle.write(b".")
            number = handle.tell()
        if number == int(os.environ["SWEEP_SLOW_CALL"]):
            calls.with_suffix(".busy").touch()
            for_a_minute()
        return function(*arguments, **named)

    return wrapped


class Slow(importlib.abc.MetaPathFinder):
    """Wraps the function as soon as its module has been imported."""

    def __init__(self, place: str) -> None:
        self.module, self.name = place.split(":")

    def find_spec(self, name: str, *_: Any) -> Any:
        if name != self.module:
            return None
        sys.meta_path.remove(self)
        spec = importlib.util.find_spec(name)
        assert spec is not None
        assert spec.loader is not None
        execute = spec.loader.exec_module

        def executed(module: Any) -> None:
            execute(module)
            *owners, last = self.name.split(".")
            owner = functools.reduce(getattr, owners, module)
            setattr(owner, last, slowed(getattr(owner, last)))

        spec.loader.exec_module = executed  # type: ignore[method-assign]
        return spec


if "SWEEP_SLOW_AT" in os.environ:
    sys.meta_path.insert(0, Slow(os.environ["SWEEP_SLOW_AT"]))
