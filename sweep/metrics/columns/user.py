"""Columns of metrics of user code."""

from __future__ import annotations

from functools import partial

import numpy as np

from ...base.errors import SweepError, ValidationIssue
from ...base.types import Array, DesignSignals, Float
from ..batch import CaseReadings
from ..metric import Metric
from ..quantity import Columns, Quantity, RequestedQuantities
from ..smooth import Rows, SmoothDesign
from ..user_metrics import Readings, UserMetric

_STEP = 1e-5
"""Half of a central difference, in units of the box."""


class UserColumns(Metric):
    """Columns of metrics of user code; `metric`: the one that is evaluated."""

    order = 9

    def __init__(self, metric: UserMetric | None = None) -> None:
        self._metric = metric

    def quantities(self, requested: RequestedQuantities) -> tuple[Quantity, ...]:
        return tuple(
            Quantity(
                name=metric.name,
                metric=metric.name,
                meaning=f"own metric {metric.code.name}: no error bound; tolerance_dn applies to CSDs only",
                unit=metric.unit,
                label=metric.label,
                digits=metric.digits,
                direction=metric.direction,
                ends=("min",) if metric.direction == "more" else ("max",),
                goal=True,
                needs="own",
                signed=True,
                smooth=partial(_rows, metric=metric),
            )
            for metric in requested.user_metrics
        )

    def of_readings(self, readings: CaseReadings) -> Columns:
        """Return the worst of the numbers that the metric says of each design; NaN if it has none for the CFA."""
        metric, n = self._metric, len(readings.dark)
        if metric is None:
            return {}
        first = metric.parts(Readings.of_setup(readings.setup, readings.dn[:1]))
        if first is None:  # and no more are read
            return {metric.name: np.full(n, np.nan)}
        parts = metric.parts(Readings.of_setup(readings.setup, readings.dn))
        if parts is None:
            return {metric.name: np.full(n, np.nan)}
        return {metric.name: parts.min(axis=1) if metric.direction == "more" else parts.max(axis=1)}


def _rows(design: SmoothDesign, *, metric: UserMetric) -> Rows:
    """Return a row for each of its numbers in every case, with derivatives by differences along the response's."""
    response, by_u = design.response, design.response_by_u
    moved = np.concatenate([response[None], response + _STEP * by_u, response - _STEP * by_u])
    parts = [_parts(metric, design, moved[:, case]) for case in range(len(response))]
    values = np.concatenate(parts, axis=1)
    n = len(by_u)
    return Rows(values[0], (values[1 : n + 1] - values[n + 1 :]).T / (2 * _STEP))


def _parts(metric: UserMetric, design: SmoothDesign, dn: DesignSignals) -> Float[Array, "designs parts"]:
    parts = metric.parts(Readings.of_setup(design.setup, dn), finite=False)  # a design without light is not feasible
    if parts is None:
        raise SweepError(
            ValidationIssue(
                f"{metric.code.name} gives None for the searched CFA", value=design.setup.camera.mosaic.name
            )
        )
    return parts
