"""Quantities of designs, one block at a time; a block that fails is halved down to the design that fails."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pyarrow as pa

from ..base.types import Array, DesignParameters, Float
from ..camera.forward import ForwardModel, forward_model
from ..camera.plan import Plan
from ..camera.setup import Setup
from ..designs.block import CurveBlock, edges_of
from ..designs.space import Space
from ..designs.tolerance import AS_DESIGNED, NONE, Tolerance
from ..metrics.bound import Bound
from ..metrics.evaluate import evaluate, family_quantities, image_quantities
from ..metrics.objective import COMBINED, Objective, columns_of
from ..metrics.quantity import OF_A_SHARE, WORST_CASE, YIELD, Columns, Quantity, RequestedQuantities
from ..metrics.user_metrics import UserMetric
from ..results.identity import CHUNK
from ..vision.section import Vision

_MOST_LETTERS = 200
_CHUNKS_BY_EDGES = 4
"""Chunks in a block of designs that are computed from their edges alone: these take little memory."""


@dataclass(frozen=True)
class Rules:
    """Rules by which designs become rows."""

    schema: pa.Schema
    requested: RequestedQuantities
    objective: Objective
    constraints: Mapping[str, Bound]
    front: tuple[str, str]
    tolerance: Tolerance
    plans: Mapping[str, Plan]
    vision: Vision | None
    seed: int

    @property
    def order(self) -> tuple[str, ...]:
        """Quantities by which designs are ranked, the first one first, all maximized."""
        return (self.objective.column, *self.front)

    @cached_property
    def quantities(self) -> Mapping[str, Quantity]:
        """Quantities by column name."""
        return columns_of(self.requested, self.objective)

    @property
    def worst(self) -> list[Quantity]:
        """Worst cases among the quantities."""
        return [quantity for quantity in self.quantities.values() if quantity.extreme == WORST_CASE]


def quantities_at(
    space: Space, start: int, points: DesignParameters, setup: Setup, rules: Rules
) -> tuple[Columns, dict[int, str]]:
    """Compute the quantities of designs of a space.

    They are computed in blocks that stay in the cache: by their edges where the family is separable, else from their
    curves. A block that fails is halved, down to the design that does.
    """
    issues: dict[int, str] = {}

    def computed(begin: int, end: int) -> list[Columns]:
        try:
            return [_columns(space, start + begin, setup, points[begin:end], rules)]
        except Exception as error:  # one design must not take the others with it
            if end - begin > 1:
                middle = (begin + end) // 2
                return computed(begin, middle) + computed(middle, end)
            issues[begin] = f"error: {text_of(error)}"
            return [dict.fromkeys(rules.quantities, np.array([np.nan]))]

    from_curves = rules.vision is not None or rules.requested.states or rules.requested.wanted_yield or rules.worst
    size = CHUNK * (1 if from_curves else _CHUNKS_BY_EDGES)
    parts = [part for begin in range(0, len(points), size) for part in computed(begin, min(begin + size, len(points)))]
    names = rules.quantities.keys() & set.intersection(*map(set, parts))
    columns = {name: np.concatenate([part[name] for part in parts]) for name in names}
    return columns, _not_finite(columns, setup, rules) | issues


def text_of(error: Exception) -> str:
    """Return an error on one line, cut if it is long."""
    return " ".join(f"{type(error).__name__}: {error}".split())[:_MOST_LETTERS]


def _columns(
    space: Space, start: int, setup: Setup, points: Float[Array, "points parameters"], rules: Rules
) -> Columns:
    """Return the quantities of a block of designs."""
    size, requested = setup.camera.grid.size, rules.requested
    model = forward_model(setup)
    edges = edges_of(space, start, start + len(points))
    designs = CurveBlock(space.curves(points, size)) if edges is None else edges
    columns = evaluate(
        model, designs, requested.states, probabilities=requested.probabilities, user_metrics=requested.user_metrics
    )
    columns |= family_quantities(None if space.filter is None else space.filter.family, points)
    if rules.vision is not None:
        columns |= image_quantities(setup, space.curves(points, size), rules.vision, rules.seed)
    if rules.worst:
        columns |= worst_cases(space, model, points, columns, rules.worst, rules.tolerance, requested.user_metrics)
    if requested.wanted_yield:
        columns |= _of_a_share(space, setup, points, rules)
    if rules.objective.column == COMBINED:
        columns[COMBINED] = rules.objective.of(columns)
    return columns


def worst_cases(
    space: Space,
    model: ForwardModel,
    points: DesignParameters,
    nominal: Columns,
    worst: Sequence[Quantity],
    tolerance: Tolerance,
    user_metrics: Sequence[UserMetric] = (),
) -> Columns:
    """Return worst cases over production errors, and of CSDs over the population of the lights."""
    setup = model.setup
    errors = (
        [production_error for production_error in tolerance.places if any(production_error)]
        if space.filter is not None
        else []
    )
    curves = [
        space.curves(points, setup.camera.grid.size, production_error) for production_error in (AS_DESIGNED, *errors)
    ]
    cases = [nominal, *(evaluate(model, shifted, user_metrics=user_metrics) for shifted in curves[1:])]
    if setup.lights.population is not None:
        from ..metrics.members import population_model  # noqa: PLC0415  (only where lights have a population)

        members = population_model(setup)
        cases = [case | members.worst(shifted) for case, shifted in zip(cases, curves, strict=True)]
    return {quantity.name: quantity.worse([case[quantity.of] for case in cases]) for quantity in worst}


def _of_a_share(space: Space, setup: Setup, points: Float[Array, "points 2"], rules: Rules) -> Columns:
    """Return the CSD that the wanted share of random lamps and cameras has."""
    from ..metrics.drawn import LampsAndCameras  # noqa: PLC0415  (only where a share of lamps and cameras counts)
    from ..metrics.members import population_model  # noqa: PLC0415

    tolerance = rules.tolerance if space.filter is not None else NONE
    drawn = LampsAndCameras(population_model(setup), tolerance, rules.seed)
    pairs = [q.pair for q in rules.quantities.values() if q.extreme == OF_A_SHARE and q.pair is not None]
    csds = drawn.columns(
        lambda production_error, designs: space.curves(points[designs], setup.camera.grid.size, production_error),
        len(points),
        pairs,
    )
    return {YIELD + name: values for name, values in csds.items()}


def _not_finite(columns: Columns, setup: Setup, rules: Rules) -> dict[int, str]:
    """Return designs with a quantity that is not finite but must be.

    Quantities of a family and metrics of user code may be missing; for a plain CFA, those of a modified channel.
    """
    needs = ("family", "own") if setup.camera.modified else ("family", "own", "modified")
    inapplicable = {name for name, quantity in rules.quantities.items() if quantity.needs in needs}
    if inapplicable & set(rules.objective.weights):
        inapplicable.add(COMBINED)
    faulty = np.zeros(len(next(iter(columns.values()))), dtype=bool)
    for name in columns.keys() - inapplicable:
        infinite = rules.quantities[name].infinite
        faulty |= ~(np.isfinite(columns[name]) | ((columns[name] == np.inf) & infinite))
    return dict.fromkeys(np.flatnonzero(faulty).tolist(), "not finite")
