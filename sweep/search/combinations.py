"""Choice from a catalog: which members, and how much of each, by a search for the amounts of every combination."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base.types import IndexArray, Parallel, Progress, delayed
from ..designs.family import ChoosingFamily
from .held import Held, held_at, search_held
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
class Tried:
    """Combination of members with its best amounts."""

    members: Members
    found: Held

    @property
    def best(self) -> Evaluation:
        """Best evaluation."""
        return self.found.best

    @property
    def rank(self) -> tuple[bool, float]:
        """What the best combination has most of."""
        return self.found.rank


@dataclass(frozen=True)
class Choice:
    """Combinations that were tried, and how many of how many, in words."""

    tried: tuple[Tried, ...]
    counts: tuple[str, ...]

    @property
    def best(self) -> Tried:
        """The best combination of the largest size; of equal ones the first."""
        largest = len(self.tried[-1].members)
        return max((one for one in self.tried if len(one.members) == largest), key=lambda one: one.rank)


def numbers_of(problem: Problem) -> IndexArray:
    """Return the numbers of the members that a problem may choose from; none if it chooses nothing.

    Parameters
    ----------
    problem : Problem
        Search problem.

    Returns
    -------
    ndarray of int, shape (n,)
        Numbers, from 1 on.
    """
    if not isinstance(problem.family, ChoosingFamily):
        return np.array([], dtype=np.intp)
    number, _ = problem.family.slots[0]
    return np.arange(math.ceil(problem.low[number]), math.floor(problem.high[number]) + 1)


def with_members(problem: Problem, members: Members) -> Problem:
    """Return the problem with its members chosen; slots without one have no amount.

    Parameters
    ----------
    problem : Problem
        Search problem of a family that chooses.
    members : tuple of int
        Numbers, at most as many as the family has slots.

    Returns
    -------
    Problem
        Problem whose numbers are fixed.
    """
    assert isinstance(problem.family, ChoosingFamily)
    held = {}
    for slot, (number, amount) in enumerate(problem.family.slots):
        held[number] = float(members[min(slot, len(members) - 1)])
        if slot >= len(members):
            held[amount] = 0.0
    return held_at(replace(problem, family=problem.family.only(np.unique(members))), held)


def amounts_of(
    problem: Problem, combinations: Sequence[Members], algorithm: str, max_evaluations: int, seed: int
) -> list[Tried]:
    """Search the amounts of combinations, from little and from more of each.

    Parameters
    ----------
    problem : Problem
        Search problem of a family that chooses.
    combinations : sequence of tuple of int
        Combinations.
    algorithm : str
        Algorithm of nlopt.
    max_evaluations : int
        Evaluations of each start at most.
    seed : int
        Seed.

    Returns
    -------
    list of Tried
        Results, in order.
    """
    return [
        Tried(members, search_held(with_members(problem, members), algorithm, max_evaluations, seed))
        for members in combinations
    ]


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

    Parameters
    ----------
    problem : Problem
        Search problem of a family that chooses.
    algorithm : str
        Algorithm of nlopt.
    max_evaluations : int
        Evaluations of each start at most.
    seed : int
        Seed.
    parallel : callable
        Runs calls on the cores.
    progress : callable
        Called with a phase, work done and work in total.
    exhaustive : int
        Combinations of one size that are all tried.

    Returns
    -------
    Choice
        Combinations.
    """
    assert isinstance(problem.family, ChoosingFamily)
    family, numbers = problem.family, numbers_of(problem)
    every: dict[Members, Tried] = {}

    def attempt(combinations: Iterable[Members]) -> None:
        new = [members for members in dict.fromkeys(combinations) if members not in every]
        parts = [new[at : at + _AT_ONCE] for at in range(0, len(new), _AT_ONCE)]
        calls = []
        for part in parts:
            some = replace(problem, family=family.only(np.unique(np.concatenate(part))))
            calls.append(delayed(amounts_of, some, part, algorithm, max_evaluations, seed))
        for done, answer in enumerate(parallel(calls), 1):
            every.update((one.members, one) for one in answer)
            progress("combinations of colorants", min(done * _AT_ONCE, len(new)), len(new))

    def ranked(size: int) -> list[Tried]:
        return sorted(
            (one for one in every.values() if len(one.members) == size), key=lambda one: one.rank, reverse=True
        )

    attempt((int(number),) for number in numbers)
    counts = [_count(len(ranked(1)), len(numbers), 1)]
    partners = sorted(one.members[0] for one in ranked(1)[:_MOST_PARTNERS])
    for size in range(2, min(len(family.slots), len(numbers)) + 1):
        total = math.comb(len(numbers), size)
        if total <= exhaustive:
            attempt(itertools.combinations(map(int, numbers), size))
        else:
            seeds = ranked(size - 1)[:_SEEDS]
            attempt(
                _joined(one.members, partner) for one in seeds for partner in partners if partner not in one.members
            )
            for _ in range(_MOST_ROUNDS):
                best = ranked(size)[0]
                kept = itertools.combinations(best.members, size - 1)
                attempt(_joined(some, partner) for some in kept for partner in partners if partner not in some)
                if ranked(size)[0] is best:
                    break
        counts.append(_count(len(ranked(size)), total, size))
    return Choice(tuple(every.values()), tuple(counts))


def _joined(members: Members, other: int) -> Members:
    return tuple(sorted((*members, other)))


def _count(tried: int, total: int, size: int) -> str:
    """Return how many combinations were tried, in words."""
    name = f"{_SIZES[size]}{'' if total == 1 else 's'}"
    return f"all {total:,} {name}" if tried == total else f"{tried:,} of {total:,} {name} by exchange"
