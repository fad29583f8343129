"""What predicts the errors of the benchmark of vision: rank correlations, with intervals."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import pandas as pd
from scipy.stats import rankdata

from ..base.types import BoolArray, FloatArray
from ..vision.scenes import SHUFFLED
from ..vision.scores import Interval, interval_around
from .vision import OBSERVER, Benchmark

PREDICTORS = {
    "csd": "CSD",
    "dprime": "d'",
    "pair_error": "pairwise error in closed form",
    OBSERVER: "ideal observer's error",
}
_FALLS = ("csd", "dprime")
"""Of these more is better; of the others less."""


@dataclass(frozen=True)
class Condition:
    """A design at a distance and a level of light: its predictors and what was measured there."""

    design: str
    distance_m: float
    level: str
    predictors: dict[str, float]
    error: float


@dataclass(frozen=True)
class Ranks:
    """Rank correlations with how rarely the network errs, of each of `PREDICTORS`: 1 predicts every order.

    `everywhere`: over all designs, distances and levels; `between`: between designs at one distance and level, the
    mean over these.
    """

    everywhere: dict[str, Interval]
    between: dict[str, Interval]
    conditions: list[Condition]


@lru_cache(maxsize=4)
def ranks_of(benchmark: Benchmark) -> Ranks:
    """What predicts the network's errors, lenses in any order; intervals by the bootstrap of scenes nested in seeds."""
    scenes, weights = benchmark.scenes(SHUFFLED), benchmark.weights(SHUFFLED)
    weights = np.vstack([np.full(weights.shape[1], 1 / weights.shape[1]), weights])
    where = list(dict.fromkeys(zip(benchmark.conditions["distance_m"], benchmark.conditions["level"], strict=True)))
    here = np.stack([((scenes["distance_m"] == d) & (scenes["level"] == v)).to_numpy() for d, v in where])
    # [draws, designs, conditions]; the first draw is the sample itself
    readers = benchmark.readers[:2]
    errors = {reader: _by_condition(benchmark.wrong(reader, SHUFFLED), here, weights) for reader in readers}
    table = benchmark.conditions.set_index(["name", "distance_m", "level"])
    known = {n: np.array([[table[n][d, *at] for at in where] for d in benchmark.designs]) for n in list(PREDICTORS)[:3]}
    judged = errors[benchmark.judge]
    everywhere, between = {}, {}
    for name in PREDICTORS:
        given = errors[name] if name in errors else np.broadcast_to(known[name], judged.shape)
        if benchmark.judge == name:
            continue
        sign = -1.0 if name in _FALLS else 1.0
        flat = _spearman(sign * given.reshape(len(given), -1), judged.reshape(len(judged), -1))
        everywhere[name] = interval_around(float(flat[0]), flat[1:])
        each = np.stack([_spearman(sign * given[:, :, at], judged[:, :, at]) for at in range(len(where))])
        mean = _mean_of_known(each)
        between[name] = interval_around(float(mean[0]), mean[1:])
    conditions = [
        Condition(
            design,
            *at,
            {n: float(errors[n][0, i, j] if n in errors else known[n][i, j]) for n in everywhere},
            float(judged[0, i, j]),
        )
        for i, design in enumerate(benchmark.designs)
        for j, at in enumerate(where)
    ]
    return Ranks(everywhere, between, conditions)


def _by_condition(wrong: pd.DataFrame, here: BoolArray, weights: FloatArray) -> FloatArray:
    """Errors, ndarray[draws, designs, conditions]; NaN where a draw has no scene of a condition."""
    values = wrong.to_numpy(dtype=float)
    found = np.full((len(weights), values.shape[1], len(here)), np.nan)
    for at, own in enumerate(here):
        total = weights[:, own].sum(axis=1, keepdims=True)
        sums = weights[:, own] @ values[own]
        found[:, :, at] = np.divide(sums, total, out=np.full_like(sums, np.nan), where=total > 0)
    return found


def _spearman(x: FloatArray, y: FloatArray) -> FloatArray:
    """Rank correlation along the last axis, ndarray[draws]; NaN where one side is the same everywhere."""
    a, b = (rankdata(each, axis=1) for each in (x, y))
    a, b = (each - each.mean(axis=1, keepdims=True) for each in (a, b))
    scale = np.sqrt((a**2).sum(axis=1) * (b**2).sum(axis=1))
    found = np.full(len(a), np.nan)
    return np.asarray(np.divide((a * b).sum(axis=1), scale, out=found, where=scale > 0), dtype=float)


def _mean_of_known(values: FloatArray) -> FloatArray:
    """The mean over the first axis of what is finite."""
    known = np.isfinite(values)
    total = np.where(known, values, 0.0).sum(axis=0)
    count = known.sum(axis=0)
    return np.asarray(np.divide(total, count, out=np.full(total.shape, np.nan), where=count > 0), dtype=float)
