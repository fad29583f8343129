"""Proof over all choices of the brighter signal of each pair, by branch and bound.

A filter may put some signals of a type above and others below those of the other type, so that a bound for one choice
of sides is none for all filters. A part of the choices is closed when a linear program with its decided sides reaches
no more than the best known filter; else the pair that its best filter separates least is decided either way. Parts
that are open when the number of programs runs out count with their own bound.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from heapq import heappop, heappush
from itertools import count

import numpy as np

from ..base.types import FloatArray, IndexArray, Int, PerWavelength
from .certificate import Certificate, Sides
from .filter_program import FilterProgram

_DIVE_STEPS = 40
_DIVE_PAIRS = 8
_NEAR = 1e-4
"""A tangent may lie this much above that of its weights, in the objective's unit."""
_MET = 1e-7
"""Pairs that lack no more than this, DN, are met: the solver's tolerance."""


@dataclass(frozen=True)
class Proof:
    """Result of branch and bound, in the objective's unit."""

    attained: float
    curve: PerWavelength | None
    proven: float
    open_parts: int
    parts: tuple[SideRegion, ...] = ()

    def proven_at(self, program: FilterProgram, sensitivity: float) -> float:
        """Return the upper bound at another least sensitivity.

        The weights of a linear program stay a proof where its right side changes, so this is a tangent, to `_NEAR`.
        """
        most = -np.inf
        for part in self.parts:
            reach = min(part.cap, program.top)
            for certificate in part.certificates:
                if reach <= most:
                    break
                reach = min(reach, program.beyond(certificate, sensitivity, max(most, 0.0), _NEAR))
            most = max(most, reach)
        return most


@dataclass(frozen=True)
class SideRegion:
    """Part of the choices of sides."""

    cap: float
    certificates: tuple[Certificate, ...] = ()


class _Conflicts:
    """Closed sets of sides: any superset is closed, and a set with all but one has that one on the other side.

    For each pair two literals: 2 pair with the first signal above, 2 pair + 1 below.
    """

    def __init__(self, n_pairs: int) -> None:
        self._n = n_pairs
        self._literals: list[int] = []
        self._starts: list[int] = []

    def add(self, sides: Sides) -> None:
        """Store a closed set of sides."""
        if sides.pairs:
            self._starts.append(len(self._literals))
            self._literals += _literals(sides).tolist()

    def applied(self, sides: Sides) -> Sides | None:
        """Return the sides with all that follow from them.

        None if they are closed.
        """
        literals, starts = np.array(self._literals, dtype=np.intp), np.array(self._starts, dtype=np.intp)
        while starts.size:
            outside = np.ones(2 * self._n, dtype=bool)
            outside[_literals(sides)] = False
            missing = np.add.reduceat(outside[literals], starts, dtype=np.intp)
            if (missing == 0).any():
                return None
            last = np.repeat(missing == 1, np.diff(starts, append=literals.size)) & outside[literals]
            forced = np.setdiff1d(literals[last] ^ 1, _literals(sides))
            if not forced.size:
                break
            if np.isin(forced ^ 1, forced).any():
                return None
            sides = sides.joined(forced // 2, np.where(forced % 2, -1.0, 1.0))
        return sides


def _literals(sides: Sides) -> Int[IndexArray, " literals"]:
    return np.array([2 * pair + (sign < 0) for pair, sign in zip(sides.pairs, sides.signs, strict=True)], dtype=np.intp)


class SideSearch:
    """Branch and bound over the sides of a program's pairs.

    `value`: objective of a filter, moved inside the constraints by rounding; -inf if it does not meet them.
    """

    def __init__(
        self,
        program: FilterProgram,
        value: Callable[[PerWavelength, PerWavelength | None], tuple[float, PerWavelength]],
        tolerance: float,
        most_programs: int,
    ) -> None:
        self._program = program
        self._value = value
        self._tolerance = tolerance
        self._most = most_programs
        self._conflicts = _Conflicts(len(program.differences))
        self._best = self._closed = -np.inf
        self._closed_parts: list[SideRegion] = []
        self._curve: FloatArray | None = None

    def run(self) -> Proof:
        """Close every part, the one with the largest bound first, within the number of programs."""
        if self._program.top < 0:
            return Proof(-np.inf, None, -np.inf, 0)
        self._offer(self._program.base)
        for side in (1.0, -1.0):
            self._dive(side)
        order = count()
        parts = [(-self._program.top, next(order), Sides(), SideRegion(self._program.top))]
        left = []
        while parts and -parts[0][0] > self._closing and self._program.solved < self._most:
            beyond, _, sides, part = heappop(parts)
            held = self._conflicts.applied(sides)
            if held is None:
                continue
            beyond, part, more = self._divided(-beyond, held, part)
            if beyond <= self._closing:
                self._closed = max(self._closed, beyond)
            elif not more:
                left.append((beyond, part))
            for part_sides, reach in more:
                region = SideRegion(min(part.cap, reach), part.certificates)
                heappush(parts, (-min(beyond, reach), next(order), part_sides, region))
        left += [(-beyond, part) for beyond, _, _, part in parts]
        far = sum(beyond > self._closing for beyond, _ in left)
        proven = max([self._closed, self._best, *(beyond for beyond, _ in left)])
        every = (*self._closed_parts, *(part for _, part in left))
        return Proof(self._best, self._curve, proven, far, every)

    @property
    def _closing(self) -> float:
        """Bound at which a part is closed."""
        return self._best + self._tolerance

    def _offer(self, curve: PerWavelength) -> None:
        """Keep a filter if it is the best one."""
        value, moved = self._value(curve, self._curve)
        if value > self._best:
            self._best, self._curve = value, moved

    def _divided(
        self, beyond: float, sides: Sides, part: SideRegion
    ) -> tuple[float, SideRegion, list[tuple[Sides, float]]]:
        """Return the bound of a part, the part, and its children with their bounds, if any."""
        t = beyond
        solved = self._program.solve(t, sides)
        beyond = min(beyond, solved.beyond)
        if solved.certificate is not None:
            part = SideRegion(part.cap, (*part.certificates, solved.certificate))
        if solved.curve is not None:
            self._offer(solved.curve)
        if solved.beyond <= self._closing:
            self._conflicts.add(solved.needs)
            self._closed = max(self._closed, solved.beyond)
            self._closed_parts.append(
                SideRegion(np.inf, part.certificates[-1:])
            )  # it closes other parts of its sides, too
        if solved.curve is None or beyond <= self._closing:
            return beyond, part, []
        differ = np.maximum(*(self._program.differ(solved.curve, side) for side in (1.0, -1.0)))
        lacks = self._program.needed(t, solved.margin) - differ
        lacks[list(sides.pairs)] = -np.inf
        pair = int(np.argmax(lacks)) if lacks.size else -1
        if pair < 0 or lacks[pair] <= _MET:
            return beyond, part, [(sides, np.inf)] if beyond < t else []
        return (
            beyond,
            part,
            [
                (sides.joined(np.array([pair]), np.array([sign])), float(self._program.reach[pair, int(sign < 0)]))
                for sign in (1.0, -1.0)
            ],
        )

    def _dive(self, side: float) -> None:
        """Search a good filter with all pairs on one side: decide the worst ones, and lower t."""
        program, beyond, sides = self._program, self._program.top, Sides()
        for _ in range(_DIVE_STEPS):
            if beyond <= self._closing or program.solved >= self._most:
                return
            t = beyond
            solved = program.solve(t, sides)
            beyond = min(beyond, solved.beyond)
            if solved.curve is None:
                return
            self._offer(solved.curve)
            lacks = program.needed(t, solved.margin) - program.differ(solved.curve, side)
            lacks[list(sides.pairs)] = -np.inf
            worst = np.argsort(-lacks, kind="stable")[:_DIVE_PAIRS]
            worst = worst[lacks[worst] > _MET]
            if not worst.size and not beyond < t:
                return
            sides = sides.joined(worst, np.full(worst.size, side))
