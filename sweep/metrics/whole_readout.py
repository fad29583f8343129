"""Metrics that need the whole readout of every design, beside the CSDs: others that are found, and a user's own."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..base.types import FloatArray, IndexArray
from ..camera.forward import ForwardModel
from .columns.color_separation import ColorSeparation
from .own import OwnMetric, own_quantities
from .quantity import Asked, Columns, ReadoutMetric
from .registry import METRICS, quantities_of

OTHERS = [metric for metric in METRICS if isinstance(metric, ReadoutMetric) and not isinstance(metric, ColorSeparation)]
"""Metrics that need the whole readout of every design."""
_AT_ONCE = 1024
"""Readouts of a design in a case that are compared at once."""
_READ_AT_ONCE = 2**19
"""Digital numbers that other metrics are given at once: 4 MiB, so that they stay in the cache."""


@dataclass
class Spent:
    """Seconds that metrics of the whole readout took, with the readouts that are made for them alone."""

    seconds: float = 0.0


def whole_readout_metrics(asked: Asked) -> list[str]:
    """Columns of a study that need the whole readout of every design: those of own metrics, and more that are found."""
    names = [quantity.name for metric in OTHERS for quantity in metric.quantities(asked)]
    return [*names, *(metric.name for metric in asked.own)]


@dataclass(frozen=True)
class WholeReadout:
    """Metrics that need the whole readout: a user's own, and those of `OTHERS`."""

    imager: ForwardModel
    own: Sequence[OwnMetric]
    spent: Spent

    def of(self, n: int, whole: Callable[[slice], FloatArray]) -> Columns:
        """The columns of n designs; `whole`: the readout of a part of them, see `ForwardModel.read`.

        A CFA of which an own metric says nothing says so of one design, and no more are read for it.
        """
        if not (self.own or OTHERS):
            return {}
        started, setup = time.perf_counter(), self.imager.setup
        first = own_quantities(self.own, setup, whole(slice(0, 1))) if self.own else {}
        columns = {name: np.full(n, values[0]) for name, values in first.items()}
        present = [metric for metric in self.own if np.isfinite(first[metric.name][0])]
        if present or OTHERS:
            values_per_design = self.imager.n_cases * len(setup.lights.names) * len(setup.camera.mosaic.channels)
            step = max(1, _READ_AT_ONCE // values_per_design)
            parts = [self._of(whole(slice(start, start + step)), present) for start in range(0, n, step)]
            columns |= {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
        self.spent.seconds += time.perf_counter() - started
        return columns

    def _of(self, response: FloatArray, own: Sequence[OwnMetric]) -> Columns:
        others = over_cases(self.imager, by_case(response, self.imager.setup.members, OTHERS)) if OTHERS else {}
        return others | own_quantities(own, self.imager.setup, response)


def by_case(response: FloatArray, members: Mapping[str, IndexArray], metrics: Sequence[ReadoutMetric]) -> Columns:
    """Evaluate metrics of the readout in each case, ndarray[n_cases, n_designs]; as many at once as a cache holds.

    `response`: ndarray[n_designs, n_cases, n_signals, n_channels].
    """
    n_designs, n_cases = response.shape[:2]
    step, parts = max(1, _AT_ONCE // max(1, n_designs)), []
    for start in range(0, n_cases, step):
        cases = np.swapaxes(response[:, start : start + step], 0, 1)
        readouts, columns = cases.reshape(-1, *cases.shape[2:]), Columns()
        for metric in metrics:
            columns |= metric.of_readout(readouts, members)
        parts.append(columns)
    return {name: np.concatenate([part[name] for part in parts]).reshape(n_cases, n_designs) for name in parts[0]}


def over_cases(imager: ForwardModel, cases: Columns) -> Columns:
    """The worst of all cases, and of CSDs the largest over the places of the smallest over the moments.

    `cases`: ndarray[n_cases, n_designs] each.
    """
    quantities = quantities_of(Asked(imager.setup.lights.classes, any_place=True))
    best = {quantity.of: name for name, quantity in quantities.items() if quantity.extreme == "best place"}
    found: Columns = {}
    for name, each in cases.items():
        if len(each) == 1:
            found |= {own: each[0].copy() for own in (name, best.get(name)) if own is not None}
            continue
        moments = quantities[name].worse(np.swapaxes(each.reshape(imager.n_cases, -1, each.shape[1]), 0, 1))
        found[name] = quantities[name].worse(moments)
        if name in best:
            found[best[name]] = moments.max(axis=0)
    return found
