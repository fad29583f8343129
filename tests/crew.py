"""Many calls, over worker processes as a run makes its own: one that is started anew costs nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TypeVar

import joblib

from sweep.run.stop import Stop
from sweep.run.workers import Workers, workers

T = TypeVar("T")
R = TypeVar("R")


def side_by_side(call: Callable[[T], R], values: Iterable[T], processes: int = 2) -> list[R]:
    """What a call gives for each value, in order; one process is this one, for what is done while two would start."""
    with workers(Workers(processes, Stop())) as crew:
        return list(crew(joblib.delayed(call)(value) for value in values))
