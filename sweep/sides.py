"""On which side of the other each signal lies: a proof over all choices, by branch and bound.

A filter may put some signals of a type above and others below those of the other type, so a bound for one choice of
sides is none for all filters. A part of the choices is closed when a linear program over the filters with the sides
that are decided so far reaches no more than the best filter known; else the pair that its best filter keeps least
apart is decided either way. What is left open when the number of programs runs out counts with its own bound.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .arrays import FloatArray
from .filter_program import FilterProgram, Sides

_DIVE_STEPS = 40
_DIVE_PAIRS = 8
_MET = 1e-7
"""Pairs that lack no more than this, DN, are met: the solver's tolerance."""


@dataclass(frozen=True)
class Proof:
    """What was found, in the objective's unit: no filter reaches more than `proven`, `curve` reaches `attained`.

    `open_parts`: parts of the choice of sides that were not brought down to `attained` and the tolerance.
    """

    attained: float
    curve: FloatArray | None
    proven: float
    open_parts: int


class SideSearch:
    """Branch and bound over the sides of a program's pairs.

    `value`: the objective of a filter as a search evaluates it, with the filter moved inside the constraints by
    rounding; -inf where it does not meet them.
    """

    def __init__(
        self,
        program: FilterProgram,
        value: Callable[[FloatArray, FloatArray | None], tuple[float, FloatArray]],
        tolerance: float,
        most_programs: int,
    ) -> None:
        self._program = program
        self._value = value
        self._tolerance = tolerance
        self._most = most_programs
        self._best = -np.inf
        self._curve: FloatArray | None = None

    def run(self) -> Proof:
        """Close every part, or as many as the number of programs allows."""
        if self._program.top < 0:
            return Proof(-np.inf, None, -np.inf, 0)
        self._offer(self._program.base)
        for side in (1.0, -1.0):
            self._dive(Sides(), side)
        proven, left = -np.inf, []
        parts = [(Sides(), self._program.top)]
        while parts and self._program.solved < self._most:
            sides, beyond = parts.pop()
            if beyond > self._best + self._tolerance:
                t = self._target
                solved = self._program.solve(t, sides)
                beyond = min(beyond, solved.beyond)
                if beyond > self._best + self._tolerance:
                    more = self._divided(t, sides, beyond, solved.curve)
                    parts += more
                    left += [] if more else [beyond]
                    continue
            proven = max(proven, beyond)
        left += [beyond for _, beyond in parts]
        far = sum(beyond > self._best + self._tolerance for beyond in left)
        return Proof(self._best, self._curve, max([proven, self._best, *left]), far)

    @property
    def _target(self) -> float:
        return max(0.0, self._best + self._tolerance / 2)

    def _offer(self, curve: FloatArray) -> None:
        """Take a filter as the best one if it is."""
        value, moved = self._value(curve, self._curve)
        if value > self._best:
            self._best, self._curve = value, moved

    def _divided(self, t: float, sides: Sides, beyond: float, curve: FloatArray | None) -> list[tuple[Sides, float]]:
        """The part again if a better filter was found, else its halves, the likelier one last; none: it stays open."""
        if curve is None:
            return []
        self._offer(curve)
        if self._best >= t:
            self._dive(sides)
            return [(sides, beyond)]
        apart = self._program.apart @ curve
        lacks = self._program.needed(t) - np.abs(apart)
        lacks[list(sides.pairs)] = -np.inf
        pair = int(np.argmax(lacks)) if lacks.size else -1
        if pair < 0 or lacks[pair] <= _MET:
            return []
        sign = 1.0 if apart[pair] >= 0 else -1.0
        return [
            (sides.joined(np.array([pair]), np.array([s])), min(beyond, self._program.reach[pair, int(s < 0)]))
            for s in (-sign, sign)
        ]

    def _dive(self, sides: Sides, side: float | None = None) -> None:
        """Look for a better filter from above: decide the worst pairs, on `side` or where they lie, and lower t."""
        program, beyond = self._program, self._program.top
        for _ in range(_DIVE_STEPS):
            if beyond <= self._target or program.solved >= self._most:
                return
            t = beyond
            solved = program.solve(t, sides)
            beyond = min(beyond, solved.beyond)
            if solved.curve is None:
                return
            self._offer(solved.curve)
            apart = program.apart @ solved.curve
            signs = np.where(apart >= 0, 1.0, -1.0) if side is None else np.full(apart.size, side)
            lacks = program.needed(t, solved.margin) - signs * apart
            lacks[list(sides.pairs)] = -np.inf
            worst = np.argsort(-lacks, kind="stable")[:_DIVE_PAIRS]
            worst = worst[lacks[worst] > _MET]
            if not worst.size and not beyond < t:
                return
            sides = sides.joined(worst, signs[worst])
