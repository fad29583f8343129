"""How any filter comes out of production, for a limit's linear programs: its shape, moved by whole steps of the grid.

A filter N = fixed + carrier x shape, of which production moves the shape by whole steps, has the shape s(l - d) at the
wavelength l: N comes out as fixed(l) + carrier(l) (N - fixed)(l - d) / carrier(l - d), which is linear in N. So what
production does is more rows of the same program. Of moves by part of a step, and of films that are too thick, nodes of
the grid do not say where the shape stands: those are left out, and a worst case over fewer is no smaller. Where N does
not say what moves in (beyond the ends of the grid, and where the carrier is next to nothing), it may be all that the
box of the family has there.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..base.types import BoolArray, FloatArray, IndexArray
from ..designs.family import Family, MovedFamily
from ..designs.tolerance import AS_DESIGNED
from .problem import Problem

_LEAST_CARRIER = 1e-3
"""Of the base curve: a shape on less is not known from N."""
_WHOLE = 1e-9
"""Moves are known to this share of a step: rounding."""


@dataclass(frozen=True)
class Distances:
    """Two lights each: their squared distance is `squared` + (rows @ N + what is not known)^2.

    `rows`: in the modified channel, DN per QE, ndarray[n, n_wavelengths]; `added`: what is not known is at most the
    first, and its negative at most the second, ndarray[n, 2]; `squared`: in the other channels, DN^2, ndarray[n].
    """

    rows: FloatArray
    squared: FloatArray
    added: FloatArray

    def least(self, curve: FloatArray) -> float:
        """The smallest one that a filter may have, ndarray[n_wavelengths]; DN."""
        apart = self.rows @ curve
        most = np.maximum(apart + self.added[:, 0], self.added[:, 1] - apart)
        return float(np.sqrt(self.squared + most**2).min())


@dataclass(frozen=True)
class Produced:
    """A filter that comes out is scale x N[source] + constant where it is `known`, else between `low` and `high`.

    All are ndarray[n_wavelengths].
    """

    source: IndexArray
    known: BoolArray
    scale: FloatArray
    constant: FloatArray
    low: FloatArray
    high: FloatArray

    def curve(self, curve: FloatArray) -> FloatArray:
        """How a filter comes out that has most where N does not say it, ndarray[n_wavelengths]."""
        return np.where(self.known, self.scale * curve[self.source] + self.constant, self.high)

    def rows(self, apart: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Sums over the filter that comes out, as sums over N; `apart`: their weights, ndarray[n, n_wavelengths].

        Second, what must be added: at most, and at most to the negative of the sum, ndarray[n, 2].
        """
        rows = np.zeros_like(apart)
        known = np.flatnonzero(self.known)  # each has a source of its own
        rows[:, self.source[known]] = apart[:, known] * self.scale[known]
        other = apart * ~self.known
        ends = [np.maximum(sign * other, 0) @ self.high + np.minimum(sign * other, 0) @ self.low for sign in (1, -1)]
        fixed = apart[:, known] @ self.constant[known]
        return rows, np.stack([ends[0] + fixed, ends[1] - fixed], axis=1)


def ways_of(problem: Problem) -> tuple[Produced, ...]:
    """How filters come out that a program knows: as designed, and with each move by whole steps that the study has.

    Where all places of the light or the sensor count, only as designed.
    """
    anywhere = problem.setup.all_heights or problem.setup.all_phases
    return (_as_designed(problem.setup.camera.base_qe[0]), *(() if anywhere else _moves(problem)))


def all_ways(problem: Problem) -> bool:
    """Whether these are all places at which a worst case is looked for."""
    return len(ways_of(problem)) == len({AS_DESIGNED, *problem.tolerance.places})


def _as_designed(base: FloatArray) -> Produced:
    nothing = np.zeros_like(base)
    return Produced(np.arange(base.size), np.ones(base.size, dtype=bool), np.ones_like(base), nothing, nothing, nothing)


def _moves(problem: Problem) -> Iterator[Produced]:
    family, step_nm = problem.family, problem.setup.camera.grid.step_nm
    if not isinstance(family, MovedFamily):
        return
    for off in problem.tolerance.places:
        steps = round(off.shift_nm / step_nm)
        if any(off) and not off.thickness and abs(off.shift_nm / step_nm - steps) < _WHOLE:
            own: Family = family.produced(off)
            ends = (end(problem.low, problem.high)[0] for end in (own.lower, own.upper))
            yield _moved(problem.setup.camera.base_qe[0], *family.moved, steps, *ends)


def _moved(
    base: FloatArray, fixed: FloatArray, carrier: FloatArray, steps: int, low: FloatArray, high: FloatArray
) -> Produced:
    source = np.arange(base.size) - steps
    inside = (source >= 0) & (source < base.size)
    source = np.where(inside, source, 0)
    known = inside & (np.abs(carrier[source]) > _LEAST_CARRIER * base.max())
    scale = np.divide(carrier, carrier[source], out=np.zeros_like(carrier), where=known)
    return Produced(source, known, scale, np.where(known, fixed - scale * fixed[source], 0.0), low, high)
