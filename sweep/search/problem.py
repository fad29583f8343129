"""Search problem: box, objective, constraints, and the log of evaluations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..base.types import Array, Float, IndexArray, Int, PerParameter
from ..camera.setup import Setup
from ..designs.family import Family
from ..designs.sobol import sobol_points
from ..designs.tolerance import AS_DESIGNED, NONE, ProductionError, Tolerance
from ..metrics.bound import FEASIBLE, Bound
from ..metrics.columns.sensitivity import CFA_SENSITIVITY
from ..metrics.objective import Objective
from ..metrics.quantity import DN, OF_A_SHARE, WORST_CASE, Quantity, RequestedQuantities, asked_of
from ..metrics.registry import quantities_of
from ..metrics.user_metrics import UserMetric
from ..spectra.lights import Pair


@dataclass(frozen=True)
class Problem:
    """Maximize an objective over a box under constraints.

    `others`: further scenarios, or sensors with the same family on their own curves: a quantity counts with its worst
    value over all.
    """

    setup: Setup
    family: Family
    low: PerParameter
    high: PerParameter
    objective: Objective
    constraints: Mapping[str, Bound]
    tolerance: Tolerance = NONE
    states: tuple[str, ...] = ()
    user_metrics: tuple[UserMetric, ...] = ()
    seed: int = 0
    others: tuple[tuple[Setup, Family], ...] = ()

    @property
    def quantities(self) -> Mapping[str, Quantity]:
        """Quantities that objective and constraints may name."""
        requested = RequestedQuantities(
            self.setup.lights.classes,
            self.states,
            edge_shift=True,
            population=self.population,
            wanted_yield=self.setup.wanted_yield,
            features=asked_of(self.setup.features),
            user_metrics=self.user_metrics,
        )
        return quantities_of(requested)

    @property
    def population(self) -> bool:
        """True if worst cases are over a population of the lights."""
        return self.setup.lights.population is not None

    @property
    def scenes(self) -> tuple[tuple[Setup, Family], ...]:
        """All scenarios or sensors."""
        return ((self.setup, self.family), *self.others)

    def n_scenes_of(self, quantity: str) -> int:
        """Return over how many of `scenes` a quantity is the worst.

        1 for quantities of a filter alone, which are the same in all scenarios of one sensor.
        """
        of_filter = self.quantities[quantity].needs in ("modified", "family") or quantity == CFA_SENSITIVITY
        one_sensor = all(family is self.family for _, family in self.others)
        return 1 if of_filter and one_sensor else len(self.scenes)

    def in_scenario(self, number: int) -> Problem:
        """Return the problem of one scenario or sensor.

        `number`: its number: 0 is `setup`. The problem has no other scenarios.
        """
        setup, family = self.scenes[number]
        return replace(self, setup=setup, family=family, others=())

    def over_population(self, quantity: str) -> bool:
        """Return whether a quantity is a worst case over the population of the lights."""
        return self.population and self.worst_distance(quantity)

    def of_a_share(self, quantity: str) -> bool:
        """Return whether a quantity is the value that a share of random lamps and cameras has."""
        return self.quantities[quantity].extreme == OF_A_SHARE

    def worst_distance(self, quantity: str) -> bool:
        """Return whether a quantity is the worst case of a CSD."""
        requested = self.quantities[quantity]
        return requested.extreme == WORST_CASE and requested.distance_kind == DN

    @property
    def has_user_objective(self) -> bool:
        """True if the objective is a metric of user code."""
        return any(self.quantities[name].needs == "own" for name in self.objective.weights)

    @property
    def signed_goal(self) -> bool:
        """True if the objective may be negative, and of any size."""
        return any(self.quantities[name].signed for name in self.objective.weights)

    @property
    def pairs(self) -> dict[str, Pair]:
        """Signal types of each distance, in DN or in units of the noise."""
        distances = [q for q in self.quantities.values() if q.distance_kind and not q.extreme]
        return {q.name: q.pair for q in distances if q.pair is not None}

    @property
    def free(self) -> Int[IndexArray, " parameters"]:
        """Indices of the parameters that are not fixed."""
        return np.flatnonzero(self.high > self.low)

    def perturbed(self, quantity: str) -> tuple[ProductionError, ...]:
        """Return the production errors over which a quantity is the smallest."""
        return self.tolerance.places if self.quantities[quantity].extreme == WORST_CASE else (AS_DESIGNED,)

    def from_unit(self, u: Float[Array, "*batch free"]) -> Float[Array, "*batch parameters"]:
        """Convert free parameters in units of the box to parameters."""
        x = np.broadcast_to(self.low, (*u.shape[:-1], self.low.size)).copy()
        # Clipped: low + 1 * (high - low) may round to above high.
        x[..., self.free] = np.clip(
            x[..., self.free] + u * (self.high - self.low)[self.free],
            self.low[self.free],
            self.high[self.free],
        )
        return x

    def to_unit(self, x: Float[Array, "*batch parameters"]) -> Float[Array, "*batch free"]:
        """Convert parameters to free ones in units of the box, clipped to it."""
        low, span = self.low[self.free], (self.high - self.low)[self.free]
        return np.asarray(np.clip((x[..., self.free] - low) / span, 0.0, 1.0), dtype=float)


@dataclass(frozen=True)
class Evaluation:
    """Logged evaluation: parameters, smooth objective, sensitivities, and largest violation (0 if feasible)."""

    x: PerParameter
    objective: float
    sensitivity: float
    cfa_sensitivity: float
    violation: float

    @property
    def feasible(self) -> bool:
        """True if every constraint is met and the objective is known."""
        return self.violation <= FEASIBLE and bool(np.isfinite(self.objective))

    @property
    def rank(self) -> tuple[bool, float]:
        """Key by which evaluations are ranked: feasible ones by objective, before others by violation."""
        return self.feasible, self.objective if self.feasible else -self.violation


CONVERGED = ("success", "ftol_reached", "xtol_reached", "settled", "roundoff_limited")
"""Final status of a start that has converged."""


@dataclass
class SearchRun:
    """Log of one start: all evaluations, and nlopt's final status."""

    start: int
    status: str = "not started"
    log: list[Evaluation] = field(default_factory=list)


def best_feasible(log: Sequence[Evaluation]) -> Evaluation | None:
    """Return the feasible evaluation with the largest objective, the first one on a tie.

    None if none is feasible.
    """
    feasible = [e for e in log if e.feasible]
    return max(feasible, key=lambda e: e.objective, default=None)


def starting_points(problem: Problem, starts: int, seed: int) -> Float[Array, "starts free"]:
    """Return starting points from a scrambled Sobol sequence."""
    free = problem.free
    dimensions = problem.family.start_dimensions or max(1, free.size)
    points = sobol_points(dimensions, starts, seed)
    if problem.family.start_dimensions is None:
        return points[:, : free.size]
    return problem.to_unit(problem.family.start(points))
