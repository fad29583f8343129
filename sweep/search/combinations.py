"""Choice from a catalog: which members, and how much of each, by a search for the amounts of every combination."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base.types import IndexArray, Int, Parallel, Progress, delayed
from ..designs.family import ChoosingFamily
from .held import fix_parameters, search_held
from .problem import Evaluation, Problem

MOST_EXHAUSTIVE = 2_000
"""Combinations of one size that are all tried; of more, those are that exchanges of members lead to."""
_MOST_PARTNERS = 1_000
"""Best single members that larger combinations are made of."""
_SEEDS = 5
_MOST_ROUNDS = 20
_AT_ONCE = 32
_SIZES = {1: "single", 2: "pair", 3: "triple"}

Members = tuple[int, ...]


@dataclass(frozen=True)
class Choice:
    """Best evaluation of each combination that was tried, and how many of how many were, in words."""

    tried: Mapping[Members, Evaluation]
    counts: tuple[str, ...]

    @property
    def best(self) -> Members:
        """The best combination of the largest size; of equal ones the first."""
        largest = max(map(len, self.tried))
        return max((m for m in self.tried if len(m) == largest), key=lambda members: self.tried[members].rank)


def numbers_of(problem: Problem) -> Int[IndexArray, " values"]:
    """Return the numbers of the members that a problem may choose from; none if it chooses nothing.

    Returns numbers, from 1 on.
    """
    if not isinstance(problem.family, ChoosingFamily):
        return np.array([], dtype=np.intp)
    number, _ = problem.family.slots[0]
    return np.arange(math.ceil(problem.low[number]), math.floor(problem.high[number]) + 1)


def with_members(problem: Problem, members: Members) -> Problem:
    """Return the problem with its members chosen; slots without one have no amount.

    `members`: numbers, at most as many as the family has slots.
    """
    assert isinstance(problem.family, ChoosingFamily)
    held = {}
    for slot, (number, amount) in enumerate(problem.family.slots):
        held[number] = float(members[min(slot, len(members) - 1)])
        if slot >= len(members):
            held[amount] = 0.0
    return fix_parameters(replace(problem, family=problem.family.only(np.unique(members))), held)


def amounts_of(
    problem: Problem, combinations: Sequence[Members], algorithm: str, max_evaluations: int, seed: int
) -> list[Evaluation]:
    """Search the amounts of combinations, from little and from more of each."""
    return [search_held(with_members(problem, members), algorithm, max_evaluations, seed) for members in combinations]


def choose(
    problem: Problem,
    algorithm: str,
    max_evaluations: int,
    seed: int,
    parallel: Parallel,
    progress: Progress,
    exhaustive: int = MOST_EXHAUSTIVE,
) -> Choice:
    """Try all single members, then larger combinations: all, or those that exchanges of one member lead to.

    An exchange begins at the best combinations of one member less with every further member. It replaces one member of
    the best combination by every other, until none is better. The order of the calls does not depend on the workers.
    """
    assert isinstance(problem.family, ChoosingFamily)
    family, numbers = problem.family, numbers_of(problem)
    tried: dict[Members, Evaluation] = {}

    def attempt(combinations: Iterable[Members]) -> None:
        new = [members for members in dict.fromkeys(combinations) if members not in tried]
        parts = [new[at : at + _AT_ONCE] for at in range(0, len(new), _AT_ONCE)]
        calls = []
        for part in parts:
            subset = replace(problem, family=family.only(np.unique(np.concatenate(part))))
            calls.append(delayed(amounts_of, subset, part, algorithm, max_evaluations, seed))
        done = 0
        for part, evaluations in zip(parts, parallel(calls), strict=True):
            tried.update(zip(part, evaluations, strict=True))
            done += len(part)
            progress("combinations of colorants", done, len(new))

    def ranked(size: int) -> list[Members]:
        return sorted((m for m in tried if len(m) == size), key=lambda members: tried[members].rank, reverse=True)

    attempt((int(number),) for number in numbers)
    counts = [_count(len(numbers), len(numbers), 1)]
    partners = sorted(number for (number,) in ranked(1)[:_MOST_PARTNERS])
    for size in range(2, min(len(family.slots), len(numbers)) + 1):
        total = math.comb(len(numbers), size)
        if total <= exhaustive:
            attempt(itertools.combinations(map(int, numbers), size))
        else:
            attempt(_extended(ranked(size - 1)[:_SEEDS], partners))
            for _ in range(_MOST_ROUNDS):
                best = ranked(size)[0]
                attempt(_extended(itertools.combinations(best, size - 1), partners))
                if ranked(size)[0] == best:
                    break
        counts.append(_count(len(ranked(size)), total, size))
    return Choice(tried, tuple(counts))


def _extended(combinations: Iterable[Members], partners: Sequence[int]) -> Iterator[Members]:
    """Yield combinations with one more member."""
    for members in combinations:
        yield from (tuple(sorted((*members, number))) for number in partners if number not in members)


def _count(tried: int, total: int, size: int) -> str:
    """Return how many combinations were tried, in words."""
    name = f"{_SIZES[size]}{'' if total == 1 else 's'}"
    return f"all {total:,} {name}" if tried == total else f"{tried:,} of {total:,} {name} by exchange"
