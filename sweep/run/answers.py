"""Answers of a search that survive a kill: each is kept as JSON as soon as it is finished."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, get_type_hints

import numpy as np

from ..base.types import Call
from ..results.journal import Journal
from ..results.records import from_json, to_json
from ..search.limit import Limit
from ..search.problem import Problem, SearchRun
from .workers import Workers


@dataclass
class Kept:
    """Runs calls as the crew does, and keeps each answer: what a killed search has finished is not searched again.

    What a call returns follows from the annotation of its function. A kept answer that is not of this type, or does not
    fit the call's problem, is not used.
    """

    crew: Workers
    journal: Journal
    fingerprint: str
    _round: int = 0
    _limits: list[str] = field(default_factory=list)

    def __call__(self, calls: Iterable[Call]) -> Iterator[Any]:
        """Answers of delayed calls in their order; errors as for `Workers` and `Journal.keep`."""
        self._round += 1
        waiting = list(calls)
        keys = [
            hashlib.sha256(f"{self.fingerprint} answer {self._round}, {at}".encode()).hexdigest()
            for at in range(len(waiting))
        ]
        read = (self._answer(key, call) for key, call in zip(keys, waiting, strict=True))
        known = {at: answer for at, answer in enumerate(read) if answer is not None}
        missing = [at for at in range(len(waiting)) if at not in known]
        started = time.monotonic()

        def keep(number: int, answer: Any) -> None:
            self.journal.keep(keys[missing[number]], to_json(answer), time.monotonic() - started)

        fresh = self.crew((waiting[at] for at in missing), finished=keep)
        for at, key in enumerate(keys):
            answer = known[at] if at in known else next(fresh)
            self._limits += [key] * isinstance(answer, Limit)
            yield answer

    def drop_limits(self) -> None:
        """Limits that cannot be right are not kept: the same command looks for them again."""
        while self._limits:
            self.journal.drop(self._limits.pop())

    def _answer(self, key: str, call: Call) -> Any:
        """The answer of an earlier, interrupted run to this call, or None."""
        content = self.journal.content(key)
        if content is None:
            return None
        try:
            answer = from_json(get_type_hints(call[0])["return"], content)
        except ValueError:
            return None
        return answer if _fits(answer, call) else None


def _fits(answer: Any, call: Call) -> bool:
    """Whether an answer can be one to a call: its designs lie in the problem's box, its curve on the study's grid."""
    problem = next((argument for argument in call[1] if isinstance(argument, Problem)), None)
    if problem is None:
        return True
    if isinstance(answer, SearchRun):
        low, high = problem.low, problem.high
        return bool(answer.log) and all(
            e.x.shape == low.shape and bool(((low <= e.x) & (e.x <= high)).all()) for e in answer.log
        )
    if isinstance(answer, Limit) and answer.curve is not None:
        return answer.curve.shape == (problem.setup.camera.grid.size,) and bool(np.isfinite(answer.curve).all())
    return True
