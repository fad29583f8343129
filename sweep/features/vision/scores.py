"""Scores of answers, with Student's t intervals over the seeds; the scenes are the same for all designs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base.types import Array, Bool, BoolArray, Float, ImageNumbers, IndexArray, Int, PerValue

CONFIDENCE = 0.95


@dataclass(frozen=True)
class Interval:
    """Value with its 95 % interval."""

    value: float
    low: float
    high: float

    def columns(self, name: str) -> dict[str, float]:
        """Return value and ends as columns of a table."""
        return {name: self.value, f"{name}_low": self.low, f"{name}_high": self.high}

    def within(self, least: float, most: float) -> Interval:
        """Return the interval cut at the ends of a quantity.

        NaN stays NaN.
        """
        low, high = (float(np.clip(end, least, most)) for end in (self.low, self.high))
        return Interval(self.value, low, high)


def interval_of_seeds(value: float, by_seed: Float[Array, " seeds"]) -> Interval:
    """Return a value with Student's t interval from its values in each seed.

    Seeds are independent: each has scenes, and readers, of its own.

    `by_seed`: value in each seed; those that are not finite are left out. NaN from fewer than two seeds.
    """
    from scipy.special import stdtrit  # noqa: PLC0415  (slow to import)

    known = by_seed[np.isfinite(by_seed)]
    if known.size < 2:
        return Interval(value, np.nan, np.nan)
    reach = stdtrit(known.size - 1, (1 + CONFIDENCE) / 2) * known.std(ddof=1) / np.sqrt(known.size)
    return Interval(value, float(value - reach), float(value + reach))


def mean_of(values: PerValue | Bool[BoolArray, " values"], seeds: Int[IndexArray, " values"]) -> Interval:
    """Return the mean of one value per scene."""
    numbers = np.asarray(values, dtype=float)
    by_seed = np.array([numbers[seeds == seed].mean() for seed in np.unique(seeds)])
    return interval_of_seeds(float(numbers.mean()), by_seed)


def confusion_matrix(truth: ImageNumbers, answered: ImageNumbers, n_states: int) -> Int[IndexArray, "states states"]:
    """Return the number of answers by true state (row) and answer (column)."""
    counts = np.zeros((n_states, n_states), dtype=np.intp)
    np.add.at(counts, (truth, answered), 1)
    return counts


def costs(
    wrong: Bool[BoolArray, " images"], probability: Float[Array, " images"], unknown_cost: float
) -> tuple[Float[Array, " images"], Bool[BoolArray, " images"]]:
    """Return the cost of each answer; a reader answers "unknown" if that is expected to cost less than 1 for an error.

    `wrong`: True if the most probable state is not the true one. Returns `unknown`: True for "unknown".
    """
    unknown = np.asarray(1 - probability > unknown_cost, dtype=bool)
    return np.where(unknown, unknown_cost, wrong.astype(float)), unknown
