"""Worst values of quantities over the numbers of a series, also between its scenarios."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

import pyarrow as pa

from ..base.types import DesignCurves, delayed
from ..camera.model import SceneModel
from ..metrics.evaluate import evaluate_some
from ..metrics.quantity import Quantity
from ..metrics.registry import METRICS
from ..results.tables import WORST
from ..study import Study
from ..study.axes import series_of
from .analysis import Calls, designs_between, table_of_calls
from .between import Between, minima_between, or_nan

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
    of_pulses = [metric for metric in METRICS if metric.needs == "pulses" and key in _OF_PULSES]
    names = [quantity.name for metric in of_pulses for quantity in metric.quantities(study.requested)]
    if study.search is not None and len(study.search.scenarios) > 1:
        names += study.objective.weights
    return [study.quantities[name] for name in names if name in study.quantities]


def _calls(study: Study, rows: pd.DataFrame) -> Calls:
    """Find the worst values of designs over each series, with all effects.

    One row per series of scenarios (`series`, `key`), design and quantity: the worst `value`, and the number `at` which
    it is, also between two scenarios.
    """
    for design in designs_between(study, rows):
        refined = refined_quantities(study, design.key["key"])
        quantities = [quantity for quantity in refined if design.rows[quantity.name].notna().any()]
        if quantities:
            numbers = [*design.numbers.values()]
            yield design.key, delayed(_worst_over, design.scenes, design.curves, quantities, study.states, numbers)


def _worst_over(
    scenes: Between, curves: DesignCurves, quantities: list[Quantity], states: tuple[str, ...], numbers: list[float]
) -> list[dict[str, str | float]]:
    """Return the worst value of each quantity of a design, and the number at which it is."""
    known: dict[float, dict[str, float]] = {}

    def value(quantity: Quantity, number: float) -> float:
        if number not in known:
            model = SceneModel(scenes.at(number))
            known[number] = evaluate_some(model, curves, quantities, states)
        return known[number][quantity.name] * (-1.0 if quantity.direction == "less" else 1.0)

    found: list[dict[str, str | float]] = []
    for quantity in quantities:
        minima = minima_between(or_nan(partial(value, quantity)), numbers)
        at = minima[0][0] if minima else math.nan
        found.append({"quantity": quantity.name, "at": at, "value": known[at][quantity.name] if minima else math.nan})
    return found


def _is_asked(study: Study) -> bool:
    return any(refined_quantities(study, key) for _, key in series_of(study.scenarios))


WORST_VALUES = table_of_calls(WORST, "worst values between scenarios", _is_asked, lambda _: _SCHEMA, _calls)
