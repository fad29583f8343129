"""Long calls over two worker processes, as a run makes its own: one that is started anew costs nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TypeVar

import joblib

from sweep.run.stop import Stop
from sweep.run.workers import Workers, workers

T = TypeVar("T")
R = TypeVar("R")


def side_by_side(call: Callable[[T], R], values: Iterable[T]) -> list[R]:
    """What a call gives for each value, in order."""
    with workers(Workers(2, Stop())) as crew:
        return list(crew(joblib.delayed(call)(value) for value in values))
