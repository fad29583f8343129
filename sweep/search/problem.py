"""The search as a mathematical problem: box, objective, constraints, and the log of what was evaluated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..base.types import FloatArray, IndexArray
from ..camera.setup import Setup
from ..curves.lights import Pair
from ..designs.family import Family
from ..designs.tolerance import AS_DESIGNED, Off, Tolerance
from ..metrics.bound import FEASIBLE, Bound
from ..metrics.objective import Objective
from ..metrics.own import OwnMetric
from ..metrics.quantity import DN, OF_A_SHARE, WORST_CASE, Asked, Quantity
from ..metrics.registry import quantities_of
from ..vision.section import SeededVision


@dataclass(frozen=True)
class Problem:
    """Maximize `objective` over the box `low`..`high` (ndarray[n_parameters]) under `constraints`.

    Quantities are those of `metrics.registry` with smooth rows; the worst ones are over edges that come out up to
    `edge_shift_nm` and films that come out up to the share `thickness` off, and over the population of the setup's
    lights. `states`: signal types that noise may confuse; `seed`: of random lamps and cameras; `vision`: images that
    readers of signal heads are shown.
    """

    setup: Setup
    family: Family
    low: FloatArray
    high: FloatArray
    objective: Objective
    constraints: Mapping[str, Bound]
    edge_shift_nm: float = 0.0
    states: tuple[str, ...] = ()
    thickness: float = 0.0
    own: tuple[OwnMetric, ...] = ()
    seed: int = 0
    vision: SeededVision | None = None

    @property
    def quantities(self) -> Mapping[str, Quantity]:
        """What objective and constraints may name."""
        tasks = () if self.setup.tasks is None else self.setup.tasks.keys
        asked = Asked(self.setup.lights.classes, self.states, edge_shift=True, tasks=tasks, own=self.own)
        population = self.setup.lights.population
        wanted = 0.0 if population is None else population.wanted_yield or 0.0
        asked = replace(asked, population=self.population, wanted_yield=wanted, vision=self.vision is not None)
        return quantities_of(asked)

    @property
    def population(self) -> bool:
        """Whether worst cases are over a population of the lights, too."""
        return self.setup.lights.population is not None

    def over_population(self, quantity: str) -> bool:
        """Whether a quantity is a worst case over the population of the lights."""
        return self.population and self.worst_distance(quantity)

    def of_a_share(self, quantity: str) -> bool:
        """Whether a quantity is what a share of random lamps and cameras has."""
        return self.quantities[quantity].extreme == OF_A_SHARE

    def worst_distance(self, quantity: str) -> bool:
        """Whether a quantity is the worst case of a CSD."""
        asked = self.quantities[quantity]
        return asked.extreme == WORST_CASE and asked.apart == DN

    @property
    def own_goal(self) -> bool:
        """Whether the objective is of an own metric."""
        return any(self.quantities[name].needs == "own" for name in self.objective.weights)

    @property
    def signed_goal(self) -> bool:
        """Whether the objective may be below 0, and of any size."""
        return any(self.quantities[name].signed for name in self.objective.weights)

    @property
    def pairs(self) -> dict[str, Pair]:
        """The pair of signal types of each distance, be it in DN or in units of the noise."""
        own = [q for q in self.quantities.values() if q.apart and not q.extreme]
        return {q.name: q.pair for q in own if q.pair is not None}

    @property
    def free(self) -> IndexArray:
        """Indices of the parameters that are not fixed."""
        return np.flatnonzero(self.high > self.low)

    @property
    def tolerance(self) -> Tolerance:
        """How far off filters may come out."""
        return Tolerance(self.edge_shift_nm, self.thickness)

    def produced(self, quantity: str) -> tuple[Off, ...]:
        """How filters may come out, over which a quantity is the smallest."""
        return self.tolerance.places if self.quantities[quantity].extreme == WORST_CASE else (AS_DESIGNED,)

    def from_unit(self, u: FloatArray) -> FloatArray:
        """Parameters from the free ones in units of the box: ndarray[..., n_free] -> ndarray[..., n_parameters]."""
        x = np.broadcast_to(self.low, (*u.shape[:-1], self.low.size)).copy()
        # Clipped: low + 1 * (high - low) may round to above high.
        x[..., self.free] = np.clip(
            x[..., self.free] + u * (self.high - self.low)[self.free],
            self.low[self.free],
            self.high[self.free],
        )
        return x

    def to_unit(self, x: FloatArray) -> FloatArray:
        """The free parameters in units of the box, clipped to it: [..., n_parameters] -> [..., n_free]."""
        low, span = self.low[self.free], (self.high - self.low)[self.free]
        return np.asarray(np.clip((x[..., self.free] - low) / span, 0.0, 1.0), dtype=float)


@dataclass(frozen=True)
class Evaluation:
    """One logged evaluation: parameters, smooth objective, sensitivities, largest violation (0: feasible)."""

    x: FloatArray
    objective: float
    sensitivity: float
    cfa_sensitivity: float
    violation: float


@dataclass
class SearchRun:
    """What one start brought: the log of all evaluations, and how nlopt ended."""

    start: int
    status: str = "not started"
    log: list[Evaluation] = field(default_factory=list)


def best_feasible(log: Sequence[Evaluation]) -> Evaluation | None:
    """The feasible evaluation with the largest objective, the earlier one on a tie; None when none is feasible."""
    feasible = [e for e in log if e.violation <= FEASIBLE and np.isfinite(e.objective)]
    return max(feasible, key=lambda e: e.objective, default=None)


def starting_points(problem: Problem, starts: int, seed: int) -> FloatArray:
    """Starting points from a scrambled Sobol set in units of the box, ndarray[starts, n_free]; one seed, one set."""
    from scipy.stats import qmc  # noqa: PLC0415  (slow to import; only a search draws points)

    free = problem.free
    dimensions = problem.family.start_dimensions or max(1, free.size)
    sobol = qmc.Sobol(d=dimensions, scramble=True, rng=np.random.default_rng(seed))
    points = np.asarray(sobol.random_base2(int(np.ceil(np.log2(max(2, starts)))))[:starts], dtype=float)
    if problem.family.start_dimensions is None:
        return points[:, : free.size]
    return problem.to_unit(problem.family.start(points))
