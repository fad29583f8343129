"""Metrics, collected from `columns`, and the columns of a study."""

from __future__ import annotations

from collections.abc import Collection, Hashable
from dataclasses import replace
from functools import lru_cache

from ..base.modules import files_in, instances_of
from ..features import modules, parts
from . import columns
from .metric import Metric
from .quantity import Quantity, RequestedQuantities

EDGES = "edges that production shifts"
POPULATION = "the population of the lights, before clipping and rounding"

METRICS = tuple(
    sorted(instances_of(Metric, [*files_in(columns), *modules("columns")]), key=lambda metric: metric.order)
)
"""All metrics in the order of their columns."""


def listed(requested: RequestedQuantities) -> list[Quantity]:
    """Return the columns of a study in order, worst cases and yields last.

    Names of pairs may coincide.
    """
    quantities = [quantity for metric in METRICS for quantity in metric.quantities(requested)]
    worst = [worst_case for quantity in quantities if (worst_case := _worst(quantity, requested)) is not None]
    drawn = [quantity for quantity in quantities if requested.wanted_yield and quantity.yield_rows is not None]
    what = "lamps and cameras" if requested.population else "sensors"
    return [*quantities, *worst, *(quantity.of_share(requested.wanted_yield, what) for quantity in drawn)]


def _worst(quantity: Quantity, requested: RequestedQuantities) -> Quantity | None:
    """Return the worst case of a quantity that may be maximized, over edges and over the population of lights."""
    over = [EDGES] if requested.edge_shift else []
    smooth_over_members = quantity.smooth_members if requested.population else None
    if smooth_over_members is not None:
        over.append(POPULATION)
    if not quantity.goal or quantity.nominal or not over:
        return None
    return replace(quantity.worst(over), smooth=quantity.smooth if smooth_over_members is None else smooth_over_members)


@lru_cache(maxsize=64)
def quantities_of(requested: RequestedQuantities) -> dict[str, Quantity]:
    """Return the columns of a study by name."""
    return {quantity.name: quantity for quantity in listed(requested)}


def owners(names: Collection[str], requested: RequestedQuantities) -> list[Metric]:
    """Return the metrics that compute some of the columns of a study."""
    return [of for of in METRICS if not {quantity.name for quantity in of.quantities(requested)}.isdisjoint(names)]


def every_feature() -> tuple[tuple[str, Hashable], ...]:
    """Return all features with what they say for an example, as `RequestedQuantities` takes them."""
    return tuple((name, module.EXAMPLE) for name, module in parts("columns").items())
