"""Error probabilities of two signal types against simulated readouts."""

from __future__ import annotations

import numpy as np

from sweep.metrics.discrimination import error_bounds, pairwise_error

from .cases_confusion import FIRST, ONE, OTHER, SECOND, random_designs
from .registry import Result, hard_case, worst


@hard_case(
    "error of a pair by simulation",
    oracle="a million Gaussian draws of each point along the normal, split where both err equally often",
    why="4 standard deviations of a share of a million",
    slow=True,
)
def error_by_simulation() -> Result:
    rng = np.random.default_rng(9)
    n, results = 1_000_000, []
    for _ in range(4):
        mean, variance = rng.uniform(0, 12, (2, 3)), 10 ** rng.uniform(0, 2, (2, 3))
        normal = 2 * (mean[1] - mean[0]) / variance.sum(axis=0)
        low, high = (
            np.sort((m + np.sqrt(v) * rng.standard_normal((n, 3))) @ normal)
            for m, v in zip(mean, variance, strict=True)
        )
        # The k-th largest of one meets the k-th smallest of the other where both err k times.
        share = np.searchsorted(high - low[::-1], 0.0) / n
        found = pairwise_error(mean[None], variance[None], ONE, OTHER)[0]
        results.append((abs(found - share), 4 * np.sqrt(found * (1 - found) / n)))
    return worst(results)


def wrong_types(mean: np.ndarray, variance: np.ndarray, kinds: np.ndarray, rng: np.random.Generator, n: int) -> float:
    """How often the most likely signal is of a wrong type, for the signal that errs most often."""
    shares = []
    for signal, kind in enumerate(kinds):
        drawn = mean[signal] + np.sqrt(variance[signal]) * rng.standard_normal((n, mean.shape[1]))
        likely = -((drawn[:, None] - mean) ** 2 / variance + np.log(variance)).sum(axis=2)
        shares.append(float((kinds[likely.argmax(axis=1)] != kind).mean()))
    return max(shares)


@hard_case(
    "the error bounds against the most likely signal",
    oracle="20,000 draws of each signal, told by maximum likelihood",
    why="a bound: nothing above it but 4 standard deviations of a share of 20,000",
    slow=True,
)
def bounds_hold() -> Result:
    rng = np.random.default_rng(10)
    n, results = 20_000, []
    for seed in range(12):
        mean, variance = random_designs(20 + seed, 1, spread=float(rng.uniform(20, 200)))
        kinds = np.array([0, 0, 0, 1, 1, 1, 1])
        allowed = 4 * np.sqrt(0.25 / n)
        bound = error_bounds(mean, variance, {"first": FIRST, "second": SECOND})[1][0]
        excess = wrong_types(mean[0], variance[0], kinds, rng, n) - bound
        results.append((max(0.0, excess), allowed))
        kinds = np.array([0, 0, 1, 1, 1, 2, 2])
        members = {str(kind): np.flatnonzero(kinds == kind) for kind in range(3)}
        excess = wrong_types(mean[0], variance[0], kinds, rng, n) - error_bounds(mean, variance, members)[1][0]
        results.append((max(0.0, excess), allowed))
    return worst(results)
