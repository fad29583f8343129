"""How good answers are, with intervals: bootstrap over scenes nested in seeds, the same scenes for all designs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.types import BoolArray, FloatArray, IndexArray

DRAWS = 1000
_CONFIDENCE = 0.95


@dataclass(frozen=True)
class Interval:
    """A value with its 95 % interval."""

    value: float
    low: float
    high: float

    @property
    def excludes_zero(self) -> bool:
        """Whether the interval is on one side of 0."""
        return self.low > 0 or self.high < 0


def nested_weights(groups: IndexArray, rng: np.random.Generator, draws: int = DRAWS) -> FloatArray:
    """Weights of scenes in bootstrap samples, ndarray[draws, n], each row's sum is 1.

    `groups`: the seed of each scene, ndarray[n]. Seeds are drawn with replacement, and then the scenes within each.
    """
    names, which = np.unique(groups, return_inverse=True)
    found = np.zeros((draws, groups.size))
    taken = rng.multinomial(len(names), np.full(len(names), 1 / len(names)), size=draws)
    for number in range(len(names)):
        own = np.flatnonzero(which == number)
        for draw in range(draws):
            times = int(taken[draw, number])
            if times:
                found[draw, own] = rng.multinomial(times * own.size, np.full(own.size, 1 / own.size))
    return np.asarray(found / found.sum(axis=1, keepdims=True), dtype=float)


def interval(value: float, samples: FloatArray) -> Interval:
    """The percentile interval of bootstrap samples, ndarray[draws]; those that are not finite are left out."""
    known = samples[np.isfinite(samples)]
    if not known.size:
        return Interval(value, np.nan, np.nan)
    low, high = np.quantile(known, [(1 - _CONFIDENCE) / 2, (1 + _CONFIDENCE) / 2])
    return Interval(value, float(low), float(high))


def interval_around(value: float, samples: FloatArray) -> Interval:
    """The value and 1.96 standard deviations of its bootstrap samples on either side.

    For rank correlations: scatter in the samples makes these smaller than the value itself, so that their percentiles
    may lie below it. For the same reason endless images would give a value that is rather farther from 0.
    """
    known = samples[np.isfinite(samples)]
    reach = 1.96 * float(known.std()) if known.size else np.nan
    return Interval(value, max(value - reach, -1.0), min(value + reach, 1.0))


def mean_of(values: FloatArray | BoolArray, weights: FloatArray) -> Interval:
    """The mean of one value for each scene, ndarray[n]; `weights`: see `nested_weights`."""
    numbers = np.asarray(values, dtype=float)
    return interval(float(numbers.mean()), weights @ numbers)


def confusion_matrix(truth: IndexArray, said: IndexArray, n_states: int) -> IndexArray:
    """How often each state (row) was said to be each (column), ndarray[n_states, n_states]."""
    found = np.zeros((n_states, n_states), dtype=np.intp)
    np.add.at(found, (truth, said), 1)
    return found


def macro_f1(matrix: IndexArray) -> float:
    """The mean over the states of the harmonic mean of precision and recall; 0 for a state that is never right."""
    right = np.diag(matrix).astype(float)
    total = matrix.sum(axis=0) + matrix.sum(axis=1)
    return float(np.mean(np.divide(2 * right, total, out=np.zeros_like(right), where=total > 0)))


def costs(wrong: BoolArray, probability: FloatArray, unknown_cost: float) -> tuple[FloatArray, BoolArray]:
    """Cost of each answer and where it is "unknown", ndarray[n] each.

    `wrong`: where the most probable state is not the true one; `probability`: of that state, as the reader says it. It
    answers "unknown" where that is expected to cost less; a wrong answer costs 1.
    """
    unknown = np.asarray(1 - probability > unknown_cost, dtype=bool)
    return np.where(unknown, unknown_cost, wrong.astype(float)), unknown
