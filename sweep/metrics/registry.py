"""Every metric, found in `columns`, and the columns of a study."""

from __future__ import annotations

from functools import lru_cache

from ..found import made_in
from . import columns
from .quantity import Asked, Metric, Quantity

METRICS = tuple(sorted(made_in(columns, Metric), key=lambda metric: metric.order))
"""All metrics in the order of their columns."""


def listed(asked: Asked) -> list[Quantity]:
    """The columns of a study in order, worst cases last; names of pairs may coincide."""
    found = [quantity for metric in METRICS for quantity in metric.quantities(asked)]
    return found + [
        quantity.worst() for quantity in found if asked.edge_shift and quantity.goal and not quantity.nominal
    ]


@lru_cache(maxsize=64)
def quantities_of(asked: Asked) -> dict[str, Quantity]:
    """The columns of a study by their names, in order."""
    return {quantity.name: quantity for quantity in listed(asked)}
