"""Scores of answers with intervals: bootstrap over scenes nested in seeds, the same scenes for all designs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.types import BoolArray, FloatArray, IndexArray

DRAWS = 1000
_CONFIDENCE = 0.95


@dataclass(frozen=True)
class Interval:
    """Value with its 95 % interval."""

    value: float
    low: float
    high: float

    @property
    def excludes_zero(self) -> bool:
        """True if the interval is on one side of 0."""
        return self.low > 0 or self.high < 0


def cluster_bootstrap_weights(groups: IndexArray, rng: np.random.Generator, draws: int = DRAWS) -> FloatArray:
    """Return weights of scenes in a two-stage bootstrap (seeds, then scenes within), each draw with a sum of 1.

    Parameters
    ----------
    groups : ndarray of int, shape (n,)
        Seed of each scene.
    rng : numpy.random.Generator
        Source of random numbers.
    draws : int
        Samples.

    Returns
    -------
    ndarray of shape (draws, n)
        Weights; each row sums to 1.
    """
    names, which = np.unique(groups, return_inverse=True)
    weights = np.zeros((draws, groups.size))
    taken = rng.multinomial(len(names), np.full(len(names), 1 / len(names)), size=draws)
    for number in range(len(names)):
        of_group = np.flatnonzero(which == number)
        for draw in range(draws):
            times = int(taken[draw, number])
            if times:
                weights[draw, of_group] = rng.multinomial(
                    times * of_group.size, np.full(of_group.size, 1 / of_group.size)
                )
    return np.asarray(weights / weights.sum(axis=1, keepdims=True), dtype=float)


def interval(value: float, samples: FloatArray) -> Interval:
    """Return the percentile interval of bootstrap samples.

    Parameters
    ----------
    value : float
        Value.
    samples : ndarray of shape (draws,)
        Samples; those that are not finite are left out.

    Returns
    -------
    Interval
        Interval.
    """
    known = samples[np.isfinite(samples)]
    if not known.size:
        return Interval(value, np.nan, np.nan)
    low, high = np.quantile(known, [(1 - _CONFIDENCE) / 2, (1 + _CONFIDENCE) / 2])
    return Interval(value, float(low), float(high))


def interval_around(value: float, samples: FloatArray) -> Interval:
    """Return a value and 1.96 standard deviations of its bootstrap samples on either side.

    For rank correlations: scatter in the samples makes these smaller than the value itself, so that their percentiles
    may lie below it.

    Parameters
    ----------
    value : float
        Value.
    samples : ndarray of shape (draws,)
        Samples.

    Returns
    -------
    Interval
        Interval.
    """
    known = samples[np.isfinite(samples)]
    reach = 1.96 * float(known.std()) if known.size else np.nan
    return Interval(value, max(value - reach, -1.0), min(value + reach, 1.0))


def mean_of(values: FloatArray | BoolArray, weights: FloatArray) -> Interval:
    """Return the mean of one value per scene.

    Parameters
    ----------
    values : ndarray of shape (n,)
        Values.
    weights : ndarray of shape (draws, n)
        Result of `cluster_bootstrap_weights`.

    Returns
    -------
    Interval
        Mean.
    """
    numbers = np.asarray(values, dtype=float)
    return interval(float(numbers.mean()), weights @ numbers)


def confusion_matrix(truth: IndexArray, answered: IndexArray, n_states: int) -> IndexArray:
    """Return the number of answers by true state (row) and answer (column).

    Parameters
    ----------
    truth, answered : ndarray of int, shape (n,)
        True states and answers.
    n_states : int
        Number of states.

    Returns
    -------
    ndarray of int, shape (n_states, n_states)
        Counts.
    """
    counts = np.zeros((n_states, n_states), dtype=np.intp)
    np.add.at(counts, (truth, answered), 1)
    return counts


def macro_f1(matrix: IndexArray) -> float:
    """Return the mean over the states of the harmonic mean of precision and recall; 0 for a state that is never right.

    Parameters
    ----------
    matrix : ndarray of int, shape (n_states, n_states)
        Confusion matrix.

    Returns
    -------
    float
        0 to 1.
    """
    right = np.diag(matrix).astype(float)
    total = matrix.sum(axis=0) + matrix.sum(axis=1)
    return float(np.mean(np.divide(2 * right, total, out=np.zeros_like(right), where=total > 0)))


def costs(wrong: BoolArray, probability: FloatArray, unknown_cost: float) -> tuple[FloatArray, BoolArray]:
    """Return the cost of each answer; a reader answers "unknown" if that is expected to cost less than 1 for an error.

    Parameters
    ----------
    wrong : ndarray of bool, shape (n,)
        True if the most probable state is not the true one.
    probability : ndarray of shape (n,)
        Probability of that state, by the reader.
    unknown_cost : float
        Cost of "unknown".

    Returns
    -------
    cost : ndarray of shape (n,)
        Costs.
    unknown : ndarray of bool, shape (n,)
        True for "unknown".
    """
    unknown = np.asarray(1 - probability > unknown_cost, dtype=bool)
    return np.where(unknown, unknown_cost, wrong.astype(float)), unknown
