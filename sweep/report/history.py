"""How a search went: the best separation and the hypervolume against the number of evaluations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from ..base.types import FloatArray, IndexArray
from ..metrics.bound import FEASIBLE, Bound
from ..metrics.pareto import hypervolume
from ..results.output import Output

_PLACES = 80


@dataclass(frozen=True)
class Start:
    """One start of the search: its number and the best feasible objective after each evaluation (NaN: none yet)."""

    number: int
    best: FloatArray


@dataclass(frozen=True)
class History:
    """`starts`: of the search itself. `evaluations`, `best`, `volume`: ndarray[n], over all starts and levels of the
    front, in the order of the log: the best feasible objective, and the hypervolume of everything feasible so far.

    The best one is over the designs that meet the study's own constraints; the hypervolume is above an objective of 0
    and `least_sensitivity`, and there is none for an objective that is no CSD.
    """

    starts: tuple[Start, ...]
    evaluations: IndexArray
    best: FloatArray
    volume: FloatArray | None
    least_sensitivity: float


def history_of(output: Output) -> History | None:
    """The history of a study's search; None where it has none."""
    log = output.searched
    if log is None or log.empty:
        return None
    own = log[log["sensitivity_min"].isna()]
    starts = tuple(Start(int(str(number)), _best_so_far(rows)) for number, rows in own.groupby("start"))
    feasible = log["violation"].to_numpy() <= FEASIBLE
    bound = output.constraints.get("sensitivity", Bound.model_construct(min=None, max=None))
    met = feasible & (bound.violation(log["sensitivity"].to_numpy()) <= FEASIBLE)
    best = np.fmax.accumulate(log["objective"].where(met).to_numpy(dtype=float))
    at = np.unique(np.geomspace(1, len(log), min(_PLACES, len(log))).round().astype(np.intp))
    pairs = log[["objective", "sensitivity"]].to_numpy(dtype=float)
    levels = log["sensitivity_min"].dropna()
    least = float(min(levels)) if len(levels) else bound.min or 0.0
    reference = np.array([0.0, least - 1e-6])
    volume = None
    if output.goal.role == "separation":
        # It cannot shrink as designs are added; the last bit of a sum in another order can.
        volume = np.maximum.accumulate([hypervolume(pairs[:n][feasible[:n]], reference) for n in at])
    return History(starts, at, best[at - 1], volume, least)


def _best_so_far(rows: pd.DataFrame) -> FloatArray:
    feasible = rows["objective"].where(rows["violation"] <= FEASIBLE).to_numpy(dtype=float)
    return np.asarray(np.fmax.accumulate(feasible), dtype=float)
