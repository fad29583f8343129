"""Results of linear programs over filters: decided sides, and weights that prove a bound."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.types import Array, Float, IndexArray, Int, PerRow, PerWavelength

ROUNDING = 1e-9
"""Filters may exceed their base by this share: rounding."""


@dataclass(frozen=True)
class Sides:
    """Pairs of signals with a decided side.

    `signs`: +1 if the first signal is above the other, -1 if it is below.
    """

    pairs: tuple[int, ...] = ()
    signs: tuple[float, ...] = ()

    def joined(self, pairs: Int[IndexArray, " pairs"], signs: Float[Array, " pairs"]) -> Sides:
        """Return these and further decided sides."""
        return Sides((*self.pairs, *map(int, pairs)), (*self.signs, *map(float, signs)))


@dataclass(frozen=True)
class Certificate:
    """Weights y of rows and decided pairs, and V(y), which bound filters at any sensitivity.

    `rows`, `pairs`: rows and pairs with a weight above 0.
    """

    rows: Int[IndexArray, " rows"]
    row_weights: PerRow
    pairs: Int[IndexArray, " pairs"]
    pair_weights: Float[Array, " pairs"]
    most: float


@dataclass(frozen=True)
class LinearSolution:
    """Result of a linear program for a t and some sides, in the objective's unit.

    `margin`: largest margin above t. `beyond`: upper bound on filters with these sides; -inf: there is none.
    """

    beyond: float
    margin: float = -np.inf
    curve: PerWavelength | None = None
    needs: Sides = Sides()
    certificate: Certificate | None = None
