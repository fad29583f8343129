"""Lamps that the search did not see."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...base.types import Array, Float
from ...results.output import Output
from ..section import MOST_ROWS, Section, Table
from ..words import lamp, of_column

_RESAMPLES = 10_000


@dataclass(frozen=True)
class LeftOut(Section):
    """How far an optimum falls on a lamp that its search did not see; `rows` are sorted, the worst first."""

    words: str
    worst: tuple[str, str]
    mean: str
    ends: tuple[str, str]
    rows: tuple[tuple[str, ...], ...]

    heading = "Lamps that the search did not see"

    @classmethod
    def of(cls, output: Output) -> Iterator[Section]:
        """Yield one for each objective."""
        if output.left_out is None:
            return
        for objective, known in output.left_out[output.left_out["fall"].notna()].groupby("objective", sort=False):
            column = output.columns[str(objective)]
            rows = known.sort_values("fall", ascending=False)
            falls = rows["fall"].to_numpy(dtype=float)
            mean, low, high = generalization_gap(falls, output.study.seed)
            cells = tuple(
                (lamp(str(row["signal"])), str(row["signal_type"]), of_column(column, row["fall"]))
                for row in rows.to_dict("records")[:MOST_ROWS]
            )
            yield cls(
                column.words,
                (cells[0][0], cells[0][2]),
                of_column(column, mean),
                (of_column(column, low), of_column(column, high)),
                cells,
            )

    @property
    def answer(self) -> list[str]:
        """What an unseen lamp costs on average, and at worst."""
        return [
            f"A lamp that the search has not seen costs {self.mean} of the {self.words} on average (95 % interval {self.ends[0]} to {self.ends[1]}), "
            f"{self.worst[0]} most: {self.worst[1]}."
        ]

    @property
    def table(self) -> Table | None:
        """The lamps that cost most."""
        return Table(("left out", "signal", "costs"), self.rows)


def generalization_gap(falls: Float[Array, " lights"], seed: int) -> tuple[float, float, float]:
    """Return the mean fall of an optimum on a light that was left out, with its 95 % interval by a bootstrap, DN.

    The interval is of lights like these, drawn at random (Efron and Tibshirani, An Introduction to the Bootstrap,
    1993, chapter 13).
    """
    rng = np.random.default_rng([seed, 2])
    means = falls[rng.integers(falls.size, size=(_RESAMPLES, falls.size))].mean(axis=1)
    low, high = np.quantile(means, (0.025, 0.975))
    return float(falls.mean()), float(low), float(high)
