"""Filters with production errors in the linear programs of the upper bound: shapes moved by whole steps of the grid.

A filter N = fixed + base transmission times shape, of which production moves the shape by whole steps, has the shape
s(l - d) at the wavelength l. With the base transmission b it becomes fixed(l) + b(l) (N - fixed)(l - d) / b(l - d),
which is linear in N. Production is therefore more rows of the same program. Moves by part of a step and thickness
errors are left out, since the shape is known at the nodes of the grid alone; a worst case over fewer moves is no
smaller. Where N does not determine the moved shape (beyond the ends of the grid, and where the base transmission is
close to 0), it may take any value of the family's box.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..base.types import Array, Bool, BoolArray, Float, IndexArray, Int, PerParameter, PerWavelength
from ..designs.family import Family, MovedFamily
from ..designs.tolerance import AS_DESIGNED
from .certificate import ROUNDING
from .problem import Problem

_LEAST_BASE_TRANSMISSION = 1e-3
"""Smallest transmission of the base curve from which the shape on it is known."""
_WHOLE = 1e-9
"""Moves are known to this share of a step: rounding."""


@dataclass(frozen=True)
class Distances:
    """Squared distances of pairs of lights: `squared` + (rows @ N + unknown part)^2.

    `rows`: differences in the modified channel, DN per QE; `squared`: in the other channels, DN^2; `added`: upper
    bounds on the unknown part and on its negative, DN; `highest`: the part of a filter at its upper bound there.
    """

    rows: Float[Array, "distances wavelengths"]
    squared: Float[Array, " distances"]
    added: Float[Array, "distances 2"]
    highest: Float[Array, " distances"]

    @classmethod
    def of(cls, rows: Float[Array, "distances wavelengths"], squared: Float[Array, " distances"]) -> Distances:
        """Return distances that N determines."""
        return cls(rows, squared, np.zeros((squared.size, 2)), np.zeros(squared.size))

    def subset(self, which: Bool[BoolArray, " distances"]) -> Distances:
        """Return some of the distances."""
        return Distances(self.rows[which], self.squared[which], self.added[which], self.highest[which])

    def produced(self, curve: PerWavelength) -> Float[Array, " distances"]:
        """Return the distances of a filter as it is produced where its unknown part is at its upper bound, DN."""
        return np.asarray(np.sqrt(self.squared + (self.rows @ curve + self.highest) ** 2))

    def least(self, curve: PerWavelength) -> float:
        """Return a lower bound on the smallest distance of a filter, DN."""
        differences = self.rows @ curve
        most = np.maximum(differences + self.added[:, 0], self.added[:, 1] - differences)
        return float(np.sqrt(self.squared + most**2).min())


@dataclass(frozen=True)
class PerturbedFilter:
    """Filter as produced: scale times N[source] + constant where it is `known`, else between `low` and `high`.

    `known`: True where N determines the filter.
    """

    source: Int[IndexArray, " wavelengths"]
    known: Bool[BoolArray, " wavelengths"]
    scale: PerWavelength
    constant: PerWavelength
    low: PerWavelength
    high: PerWavelength

    def curve(self, curve: PerWavelength) -> PerWavelength:
        """Return the produced filter, at its upper bound where it is unknown."""
        return np.where(self.known, self.scale * curve[self.source] + self.constant, self.high)

    def distances(self, differences: Float[Array, "distances wavelengths"]) -> Distances:
        """Convert differences in the produced filter to those of N; those in other channels are 0."""
        rows = np.zeros_like(differences)
        known = np.flatnonzero(self.known)  # each has a source of its own
        rows[:, self.source[known]] = differences[:, known] * self.scale[known]
        other = differences * ~self.known
        ends = [np.maximum(sign * other, 0) @ self.high + np.minimum(sign * other, 0) @ self.low for sign in (1, -1)]
        fixed = differences[:, known] @ self.constant[known]
        added = np.stack([ends[0] + fixed, ends[1] - fixed], axis=1)
        return Distances(rows, np.zeros(len(rows)), added, other @ self.high + fixed)


def perturbed_filters(problem: Problem) -> tuple[PerturbedFilter, ...]:
    """Return the filters as produced that a program knows: as designed, and moved by whole steps."""
    anywhere = problem.setup.all_heights or problem.setup.all_phases
    return (_as_designed(problem.setup.camera.base_qe[0]), *(() if anywhere else _moves(problem)))


def highest(problem: Problem) -> PerWavelength:
    """Return the most that filters of the problem have: the replaced curve, or the box where it reaches above that."""
    base = np.asarray(problem.setup.camera.base_qe[0], dtype=float)
    if not reaches_above(problem):
        return base
    return np.asarray(np.maximum(base, problem.family.upper(problem.low, problem.high)[0]), dtype=float)


def reaches_above(problem: Problem) -> bool:
    """Return whether filters of the box may exceed the curve that they replace."""
    top = problem.family.upper(problem.low, problem.high)[0]
    return bool((top > problem.setup.camera.base_qe[0] * (1 + ROUNDING)).any())


def all_ways(problem: Problem) -> bool:
    """Return whether these are all production errors at which a worst case is searched."""
    return len(perturbed_filters(problem)) == len({AS_DESIGNED, *problem.tolerance.places})


def _as_designed(base: PerWavelength) -> PerturbedFilter:
    nothing = np.zeros_like(base)
    return PerturbedFilter(
        np.arange(base.size), np.ones(base.size, dtype=bool), np.ones_like(base), nothing, nothing, nothing
    )


def _moves(problem: Problem) -> Iterator[PerturbedFilter]:
    family, step_nm = problem.family, problem.setup.camera.grid.step_nm
    if not isinstance(family, MovedFamily):
        return
    for production_error in problem.tolerance.places:
        steps = round(production_error.shift_nm / step_nm)
        if (
            any(production_error)
            and not (production_error.thickness or production_error.broadening)
            and abs(production_error.shift_nm / step_nm - steps) < _WHOLE
        ):
            perturbed: Family = family.perturbed(production_error)
            ends = (end(problem.low, problem.high)[0] for end in (perturbed.lower, perturbed.upper))
            yield _moved(problem.setup.camera.base_qe[0], *family.moved, steps, *ends)


def _moved(
    base: PerWavelength,
    fixed: Float[Array, " examples"],
    base_transmission: PerWavelength,
    steps: int,
    low: PerParameter,
    high: PerParameter,
) -> PerturbedFilter:
    source = np.arange(base.size) - steps
    inside = (source >= 0) & (source < base.size)
    source = np.where(inside, source, 0)
    known = inside & (np.abs(base_transmission[source]) > _LEAST_BASE_TRANSMISSION * base.max())
    scale = np.divide(base_transmission, base_transmission[source], out=np.zeros_like(base_transmission), where=known)
    return PerturbedFilter(source, known, scale, np.where(known, fixed - scale * fixed[source], 0.0), low, high)
