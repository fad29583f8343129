"""Answers of a search that survive a kill: each is a part, as JSON, as soon as it is finished."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, get_type_hints

import numpy as np

from ..base.types import Call
from ..results.parts import ANSWER, Parts
from ..results.records import from_json, to_json
from ..search.limit import Limit
from ..search.problem import Problem, SearchRun
from .workers import Workers


@dataclass
class KeptAnswers:
    """Calls as the workers run them, each answer kept: what a killed search has finished is not searched again.

    What a call returns follows from the annotation of its function. A kept answer that is not of this type, or does not
    fit the call's problem, is not used.
    """

    crew: Workers
    parts: Parts
    fingerprint: str
    _round: int = 0
    _limits: list[str] = field(default_factory=list)

    def __call__(self, calls: Iterable[Call]) -> Iterator[Any]:
        """Answers of calls in their order; errors as for `Workers` and `Parts.save`."""
        self._round += 1
        waiting = list(calls)
        keys = [
            hashlib.sha256(f"{self.fingerprint} answer {self._round}, {at}".encode()).hexdigest()
            for at in range(len(waiting))
        ]
        known = {at: self._answer(key, call) for at, (key, call) in enumerate(zip(keys, waiting, strict=True))}
        known = {at: answer for at, answer in known.items() if answer is not None}
        missing = [at for at in range(len(waiting)) if at not in known]
        fresh = self.crew.unordered(waiting[at] for at in missing)
        for at, key in enumerate(keys):
            while at not in known:
                number, answer = next(fresh)
                known[missing[number]] = answer
                self.parts.save(keys[missing[number]], ANSWER, to_json(answer))
            self._limits += [key] * isinstance(known[at], Limit)
            yield known.pop(at)

    def drop_limits(self) -> None:
        """Limits that cannot be right are not kept: the same command looks for them again."""
        while self._limits:
            self.parts.forget(self._limits.pop())

    def _answer(self, key: str, call: Call) -> Any:
        """The answer of an earlier, interrupted run to this call, or None."""
        content = self.parts.read(key)
        if content is None:
            return None
        try:
            answer = from_json(get_type_hints(call[0])["return"], content)
        except ValueError:
            return None
        return answer if _fits(answer, call) else None


def _fits(answer: Any, call: Call) -> bool:
    """True where an answer can be one to a call: its designs lie in the problem's box, its curve on the grid."""
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
