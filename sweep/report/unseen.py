"""How an answer does on lights that its search did not see."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..base.types import FloatArray
from ..metrics.quantity import HELD_OUT
from ..results.output import Output
from .leaders import Row

_RESAMPLES = 10_000


def unseen_told(output: Output, row: Row) -> str:
    """What a row has on lights that it has not seen, to go behind what it has on its own; empty without such lights."""
    separation = output.trade_off[0]
    held_out = float(row.get(HELD_OUT + (separation.of or separation.name), np.nan))
    return f" ({separation.told(held_out)} on lights that it has not seen)" if np.isfinite(held_out) else ""


def unseen_lines(output: Output) -> Iterator[str]:
    """What the search loses on lights that are left out of it."""
    if output.left_out is None:
        return
    several = output.left_out["objective"].nunique() > 1
    for objective, rows in output.left_out[output.left_out["fall"].notna()].groupby("objective", sort=False):
        quantity = output.columns[str(objective)]
        of = f" of the {quantity.words}" if several else ""
        worst = rows.nlargest(1, "fall").iloc[0]
        yield f"Left out of the search, {worst['signal']} costs its optimum{of} most: {quantity.told(worst['fall'])}."
        falls = rows["fall"].to_numpy()
        if falls.size > 1:
            mean, low, high = generalization_gap(falls, output.study.seed)
            ends = f"95 % interval {quantity.told(low)} to {quantity.told(high)}"
            yield f"A light that the search{of} has not seen costs {quantity.told(mean)} on average ({ends})."


def generalization_gap(falls: FloatArray, seed: int) -> tuple[float, float, float]:
    """The mean fall of an optimum on a light that was left out, with its 95 % interval by a bootstrap over the lights.

    `falls`: DN, ndarray[n_lights]. The interval is of lights like these, drawn at random (Efron and Tibshirani, An
    Introduction to the Bootstrap, 1993, chapter 13).
    """
    rng = np.random.default_rng([seed, 2])
    means = falls[rng.integers(falls.size, size=(_RESAMPLES, falls.size))].mean(axis=1)
    low, high = np.quantile(means, (0.025, 0.975))
    return float(falls.mean()), float(low), float(high)
