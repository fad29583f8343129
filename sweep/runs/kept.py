"""Answers of a search that survive a kill: each is a file as soon as it is finished."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, get_type_hints

from ..base.types import Call
from ..results.answers import Answers
from ..results.records import from_json, to_json
from ..search.upper_bound import UpperBound
from .workers import Workers


@dataclass
class CachedCalls:
    """Calls on the workers, each answer kept, so that a killed search repeats no finished call.

    The type of an answer is the annotation of its function.
    """

    pool: Workers
    answers: Answers
    fingerprint: str
    _round: int = 0
    _limits: list[str] = field(default_factory=list)

    def __call__(self, calls: Iterable[Call]) -> Iterator[Any]:
        """Yield the answers of calls in order."""
        self._round += 1
        waiting = list(calls)
        keys = [
            hashlib.sha256(f"{self.fingerprint} answer {self._round}, {at}".encode()).hexdigest()
            for at in range(len(waiting))
        ]
        finished = {at: self._answer(key, call) for at, (key, call) in enumerate(zip(keys, waiting, strict=True))}
        finished = {at: answer for at, answer in finished.items() if answer is not None}
        missing = [at for at in range(len(waiting)) if at not in finished]
        fresh = self.pool.unordered(waiting[at] for at in missing)
        for at, key in enumerate(keys):
            while at not in finished:
                number, answer = next(fresh)
                finished[missing[number]] = answer
                self.answers.save(keys[missing[number]], to_json(answer))
            if isinstance(finished[at], UpperBound):
                self._limits.append(key)
            yield finished.pop(at)

    def drop_limits(self) -> None:
        """Forget upper bounds that cannot be right, so that the same command computes them again."""
        while self._limits:
            self.answers.forget(self._limits.pop())

    def _answer(self, key: str, call: Call) -> Any:
        """Return the answer of an earlier, interrupted run, or None."""
        content = self.answers.read(key)
        with suppress(ValueError):
            return None if content is None else from_json(get_type_hints(call[0])["return"], content)
        return None
