"""What linear programs of filters find: which sides are decided, and weights that prove a bound."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.types import FloatArray, IndexArray

ROUNDING = 1e-9
"""Filters may exceed their base by this share: rounding."""


@dataclass(frozen=True)
class Sides:
    """Pairs of signals with a decided side: their indices, and +1 where the first signal is above the other, or -1."""

    pairs: tuple[int, ...] = ()
    signs: tuple[float, ...] = ()

    def joined(self, pairs: IndexArray, signs: FloatArray) -> Sides:
        """These and more pairs."""
        return Sides((*self.pairs, *map(int, pairs)), (*self.signs, *map(float, signs)))


@dataclass(frozen=True)
class Certificate:
    """Weights y of rows and of pairs with a decided side, and V(y): they bound what filters reach at any sensitivity.

    `rows`, `pairs`: those whose `row_weights` and `pair_weights` are above 0, ndarray[n] each; `most`: V(y).
    """

    rows: IndexArray
    row_weights: FloatArray
    pairs: IndexArray
    pair_weights: FloatArray
    most: float


@dataclass(frozen=True)
class Solved:
    """What a linear program for a t and some sides found, in the objective's unit.

    `beyond`: no filter with these sides reaches more (-inf: there is none), and already those of `needs` say so, by
    `certificate`. `curve`: the filter with the largest `margin` above t, QE; None where no filter was found.
    """

    beyond: float
    margin: float = -np.inf
    curve: FloatArray | None = None
    needs: Sides = Sides()
    certificate: Certificate | None = None
