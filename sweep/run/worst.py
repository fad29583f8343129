"""Worst values of quantities over the numbers of a series, also between its scenarios."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

import pyarrow as pa

from ..base.types import DesignCurves, Parallel, Progress, delayed
from ..camera.forward import ForwardModel
from ..metrics.columns.flicker import FALSE_HUE, LAMP_SEEN, MODULATION
from ..metrics.evaluate import evaluate_some
from ..metrics.quantity import Quantity
from ..results.designs import rows_of_series
from ..study import Study
from ..study.axes import series_of
from .between import Between, between, minima_between, or_nan
from .workers import run_with_progress

if TYPE_CHECKING:
    import pandas as pd

_OF_PULSES = ("frequency_hz", "duty")
"""Numbers of a pulsed lamp, over which its modulation and hue are refined."""
_SCHEMA = pa.schema(
    [(name, pa.string()) for name in ("name", "series", "key", "quantity")]
    + [(name, pa.float64()) for name in ("at", "value")]
)


def refined_quantities(study: Study, key: str) -> list[Quantity]:
    """Return quantities whose worst value over a series is told: of pulses, and what a search of it maximizes."""
    names = [FALSE_HUE, LAMP_SEEN, MODULATION] if key in _OF_PULSES else []
    if study.search is not None and len(study.search.scenarios) > 1:
        names += study.objective.weights
    return [study.quantities[name] for name in names if name in study.quantities]


def worst_table(study: Study, rows: pd.DataFrame, parallel: Parallel, progress: Progress) -> pa.Table:
    """Find the worst values of designs over each series, with all effects.

    One row per series of scenarios (`series`, `key`), design and quantity: the worst `value`, and the number `at` which
    it is, also between two scenarios.
    """
    keys, calls = [], []
    for series, key, scenarios, row, curves, space in rows_of_series(study, rows):
        scenes = between(study, study.setup(space, next(iter(scenarios))), scenarios)
        known = rows[(rows["name"] == row["name"]) & rows["scenario"].isin(list(scenarios))]
        quantities = [quantity for quantity in refined_quantities(study, key) if known[quantity.name].notna().any()]
        if scenes is not None and quantities:
            keys.append({"name": row["name"], "series": series, "key": key})
            calls.append(delayed(worst_over, scenes, curves, quantities, study.states, [*scenarios.values()]))
    answers = run_with_progress(parallel, calls, "worst values between scenarios", progress)
    table_rows = [key | row for key, found in zip(keys, answers, strict=True) for row in found]
    return pa.Table.from_pylist(table_rows, schema=_SCHEMA)


def worst_over(
    scenes: Between, curves: DesignCurves, quantities: list[Quantity], states: tuple[str, ...], numbers: list[float]
) -> list[dict[str, str | float]]:
    """Return the worst value of each quantity of a design, and the number at which it is."""
    known: dict[float, dict[str, float]] = {}

    def value(quantity: Quantity, number: float) -> float:
        if number not in known:
            model = ForwardModel(scenes.at(number), once=True)
            known[number] = evaluate_some(model, curves, quantities, states)
        return known[number][quantity.name] * (-1.0 if quantity.direction == "less" else 1.0)

    found: list[dict[str, str | float]] = []
    for quantity in quantities:
        minima = minima_between(or_nan(partial(value, quantity)), numbers)
        at = minima[0][0] if minima else math.nan
        found.append({"quantity": quantity.name, "at": at, "value": known[at][quantity.name] if minima else math.nan})
    return found


def has_worst(study: Study) -> bool:
    """Return whether a study has series with quantities whose worst value is told."""
    return any(refined_quantities(study, key) for _, key in series_of(study.scenarios))
