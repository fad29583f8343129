"""Metrics, collected from `columns`, and the columns of a study."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

from ..base.modules import made_in
from . import columns
from .quantity import Asked, Metric, Quantity

EDGES = "edges that production shifts"
POPULATION = "the population of the lights, before clipping and rounding"

METRICS = tuple(sorted(made_in(columns, Metric), key=lambda metric: metric.order))
"""All metrics in the order of their columns."""


def listed(asked: Asked) -> list[Quantity]:
    """Return the columns of a study in order, worst cases and yields last.

    Parameters
    ----------
    asked : Asked
        Requested quantities.

    Returns
    -------
    list of Quantity
        Columns; names of pairs may coincide.
    """
    found = [quantity for metric in METRICS for quantity in metric.quantities(asked)]
    worst = [own for quantity in found if (own := _worst(quantity, asked)) is not None]
    drawn = [quantity for quantity in found if asked.wanted_yield and quantity.smooth_drawn is not None]
    return [*found, *worst, *(quantity.of_share(asked.wanted_yield) for quantity in drawn)]


def _worst(quantity: Quantity, asked: Asked) -> Quantity | None:
    """Return the worst case of a quantity that may be maximized, over edges and over the population of lights."""
    over = [EDGES] if asked.edge_shift else []
    seen = quantity.smooth_members if asked.population else None
    if seen is not None:
        over.append(POPULATION)
    if not quantity.goal or quantity.nominal or not over:
        return None
    return replace(quantity.worst(over), smooth=quantity.smooth if seen is None else seen)


@lru_cache(maxsize=64)
def quantities_of(asked: Asked) -> dict[str, Quantity]:
    """Return the columns of a study by name.

    Parameters
    ----------
    asked : Asked
        Requested quantities.

    Returns
    -------
    dict of str to Quantity
        Columns in order.
    """
    return {quantity.name: quantity for quantity in listed(asked)}
