"""Predictors of the errors of the benchmark of vision: rank correlations, with intervals."""

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
"""Predictors of which more is better."""


@dataclass(frozen=True)
class Ranks:
    """Rank correlations with how rarely the network errs, of each of `PREDICTORS`: 1 predicts every order.

    `everywhere`: over all designs, distances and levels; `between`: between designs at one distance and level, the
    mean over these. `conditions`: a row per design, distance and level, with all predictors and the measured `error`.
    """

    everywhere: dict[str, Interval]
    between: dict[str, Interval]
    conditions: pd.DataFrame


@lru_cache(maxsize=4)
def ranks_of(benchmark: Benchmark) -> Ranks:
    """Predictors of the network's errors, lenses in any order; intervals by the bootstrap of scenes nested in seeds."""
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
        at_each = np.stack([_spearman(sign * given[:, :, at], judged[:, :, at]) for at in range(len(where))])
        mean = np.ma.masked_invalid(at_each).mean(axis=0).filled(np.nan)
        between[name] = interval_around(float(mean[0]), mean[1:])
    conditions = pd.DataFrame(
        [{"design": d, "distance_m": m, "level": level} for d in benchmark.designs for m, level in where]
    )
    for name in everywhere:
        conditions[name] = (errors[name][0] if name in errors else known[name]).ravel()
    conditions["error"] = judged[0].ravel()
    return Ranks(everywhere, between, conditions)


def _by_condition(wrong: pd.DataFrame, here: BoolArray, weights: FloatArray) -> FloatArray:
    """Errors, ndarray[draws, designs, conditions]; NaN where a draw has no scene of a condition."""
    values = wrong.to_numpy(dtype=float)
    errors = np.full((len(weights), values.shape[1], len(here)), np.nan)
    for at, scenes in enumerate(here):
        total = weights[:, scenes].sum(axis=1, keepdims=True)
        sums = weights[:, scenes] @ values[scenes]
        errors[:, :, at] = np.divide(sums, total, out=np.full_like(sums, np.nan), where=total > 0)
    return errors


def _spearman(x: FloatArray, y: FloatArray) -> FloatArray:
    """Rank correlation along the last axis, ndarray[draws]; NaN where one side is the same everywhere."""
    a, b = (rankdata(values, axis=1) for values in (x, y))
    a, b = (ranks - ranks.mean(axis=1, keepdims=True) for ranks in (a, b))
    scale = np.sqrt((a**2).sum(axis=1) * (b**2).sum(axis=1))
    out = np.full(len(a), np.nan)
    return np.asarray(np.divide((a * b).sum(axis=1), scale, out=out, where=scale > 0), dtype=float)
