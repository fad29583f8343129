"""Quantities of designs, one block at a time; a block that fails is halved down to the design that fails."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pyarrow as pa

from ..base.types import DesignNumbers, DesignParameters
from ..camera.model import SceneModel, scene_model
from ..camera.plan import Plan
from ..camera.setup import Setup
from ..designs.block import Block, CurveBlock, edges_of_some
from ..designs.space import Space
from ..designs.tolerance import AS_DESIGNED, NONE, Tolerance
from ..metrics.bound import Bound
from ..metrics.columns.chromatic import CHROMATIC_CSD
from ..metrics.columns.pixel_separation import CHROMATIC_PIXEL_CSD
from ..metrics.evaluate import evaluate
from ..metrics.metric import Metric
from ..metrics.objective import COMBINED, Objective, columns_of
from ..metrics.quantity import OF_A_SHARE, WORST_CASE, YIELD, Columns, Quantity, RequestedQuantities
from ..metrics.registry import METRICS, owners
from ..metrics.user_metrics import UserMetric
from ..results.identity import CHUNK
from ..results.tables import ON_FRONT
from ..spectra.lights import Pair

_MOST_LETTERS = 200


@dataclass(frozen=True)
class Rules:
    """Rules by which designs become rows.

    `schema`: of the rows of a run; `shown`: of those that its report shows; `places`: of the scenes on the axes;
    `in_series`: scenes after the first of their series, whose rows have the `asked` quantities alone.
    """

    schema: pa.Schema
    shown: pa.Schema
    requested: RequestedQuantities
    objective: Objective
    constraints: Mapping[str, Bound]
    front: tuple[str, str]
    tolerance: Tolerance
    plans: Mapping[str, Plan]
    seed: int
    places: Mapping[str, Mapping[str, str | float]]
    in_series: frozenset[str]
    asked: frozenset[str]

    def at(self, scenario: str, wanted: Wanted) -> Wanted:
        """Return what of some quantities the rows of a scene have."""
        if scenario not in self.in_series:
            return wanted
        asked = {name: quantity for name, quantity in wanted.quantities.items() if name in self.asked}
        return Wanted.of(asked, self.requested, wanted.schema)

    @cached_property
    def quantities(self) -> Mapping[str, Quantity]:
        """Quantities by column name."""
        return columns_of(self.requested, self.objective)

    @cached_property
    def wanted(self) -> Wanted:
        """All of them."""
        return Wanted.of(self.quantities, self.requested, self.shown)

    @cached_property
    def wanted_of_swept(self) -> Wanted:
        """Those of the rows of a run."""
        schema = self.schema.append(self.shown.field(ON_FRONT))
        swept = {name: quantity for name, quantity in self.quantities.items() if name in schema.names}
        return Wanted.of(swept, self.requested, schema)


@dataclass(frozen=True)
class Wanted:
    """Quantities that designs are evaluated for, the metrics that compute them, and their rows with `pareto`."""

    schema: pa.Schema
    quantities: Mapping[str, Quantity]
    metrics: tuple[Metric, ...]
    chromatic: tuple[Pair, ...]
    user_metrics: tuple[UserMetric, ...]

    @classmethod
    def of(cls, quantities: Mapping[str, Quantity], requested: RequestedQuantities, schema: pa.Schema) -> Wanted:
        """Return the metrics of some quantities."""
        metrics = [m for m in METRICS if quantities.keys() & {q.name for q in m.quantities(requested)}]
        of_any = (CHROMATIC_CSD, CHROMATIC_PIXEL_CSD)
        pairs = dict.fromkeys(q.pair for q in quantities.values() if q.metric in of_any and q.pair and not q.extreme)
        user_metrics = [metric for metric in requested.user_metrics if metric.name in quantities]
        return cls(schema, quantities, tuple(metrics), tuple(pairs), tuple(user_metrics))

    @property
    def names(self) -> frozenset[str]:
        """Names of the quantities, and of their nominal values."""
        return frozenset(name for of in self.quantities.values() for name in (of.name, of.of) if name)

    def of_extreme(self, extreme: str) -> list[Quantity]:
        """Return the worst cases, or the yields, among the quantities."""
        return [quantity for quantity in self.quantities.values() if quantity.extreme == extreme]


def quantities_at(
    space: Space, numbers: DesignNumbers, setup: Setup, rules: Rules, wanted: Wanted
) -> tuple[Columns, dict[int, str]]:
    """Compute the quantities of designs of a space.

    They are computed in blocks that stay in the cache: by their edges where the family is separable, else from their
    curves. A block that fails is halved, down to the design that does.
    """
    issues: dict[int, str] = {}

    def computed(begin: int, end: int) -> list[Columns]:
        try:
            return [_columns(space, numbers[begin:end], setup, rules, wanted)]
        except Exception as error:  # one design must not take the others with it
            if end - begin > 1:
                middle = (begin + end) // 2
                return computed(begin, middle) + computed(middle, end)
            issues[begin] = f"error: {text_of(error)}"
            return [dict.fromkeys(wanted.quantities, np.array([np.nan]))]

    parts = [part for at in range(0, len(numbers), CHUNK) for part in computed(at, min(at + CHUNK, len(numbers)))]
    names = wanted.quantities.keys() & set.intersection(*map(set, parts))
    columns = {name: np.concatenate([part[name] for part in parts]) for name in names}
    return columns, _not_finite(columns, setup, rules) | issues


def text_of(error: Exception) -> str:
    """Return an error on one line, cut if it is long."""
    return " ".join(f"{type(error).__name__}: {error}".split())[:_MOST_LETTERS]


def _columns(space: Space, numbers: DesignNumbers, setup: Setup, rules: Rules, wanted: Wanted) -> Columns:
    """Return the quantities of a block of designs."""
    points, edges = space.points_of(numbers), edges_of_some(space, numbers)
    designs = CurveBlock(space.curves(points, setup.camera.grid.size)) if edges is None else edges
    return columns_of_points(space, points, designs, setup, rules, wanted)


def columns_of_points(
    space: Space, points: DesignParameters, designs: Block, setup: Setup, rules: Rules, wanted: Wanted
) -> Columns:
    """Return the quantities of designs of a space."""
    model, requested = scene_model(setup), rules.requested
    columns = evaluate(
        model,
        designs,
        requested.states,
        user_metrics=wanted.user_metrics,
        metrics=wanted.metrics,
        chromatic=wanted.chromatic,
        family=None if space.filter is None else space.filter.family,
        points=points,
        refined=wanted.names,
    )
    if worst := wanted.of_extreme(WORST_CASE):
        columns |= worst_cases(space, model, points, columns, worst, rules.tolerance, wanted.user_metrics)
    if yields := wanted.of_extreme(OF_A_SHARE):
        columns |= _of_a_share(space, setup, points, rules, yields)
    if COMBINED in wanted.quantities:
        columns[COMBINED] = rules.objective.of(columns)
    return columns


def worst_cases(
    space: Space,
    model: SceneModel,
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
    chromatic = [quantity.pair for quantity in worst if quantity.metric == CHROMATIC_CSD and quantity.pair is not None]
    requested = RequestedQuantities(setup.lights.classes, any_place=True, user_metrics=tuple(user_metrics))
    metrics = owners({quantity.of for quantity in worst}, requested)
    shifted_cases = [
        evaluate(model, shifted, user_metrics=user_metrics, metrics=metrics, chromatic=chromatic)
        for shifted in curves[1:]
    ]
    cases = [nominal, *shifted_cases]
    if setup.lights.population is not None:
        from ..metrics.members import population_model  # noqa: PLC0415  (only where lights have a population)

        members = population_model(setup)
        cases = [case | members.worst(shifted) for case, shifted in zip(cases, curves, strict=True)]
    return {quantity.name: quantity.worse([case[quantity.of] for case in cases]) for quantity in worst}


def _of_a_share(
    space: Space, setup: Setup, points: DesignParameters, rules: Rules, yields: Sequence[Quantity]
) -> Columns:
    """Return the CSD that the wanted share of random lamps and cameras has."""
    from ..metrics.drawn_sensors import searched_sample  # noqa: PLC0415  (only where a share of cameras counts)

    drawn = searched_sample(setup, rules.tolerance if space.filter is not None else NONE, rules.seed)
    pairs = [quantity.pair for quantity in yields if quantity.pair is not None]
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
