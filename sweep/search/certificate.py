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

    Parameters
    ----------
    pairs : tuple of int
        Indices of pairs.
    signs : tuple of float
        +1 if the first signal is above the other, -1 if it is below.
    """

    pairs: tuple[int, ...] = ()
    signs: tuple[float, ...] = ()

    def joined(self, pairs: Int[IndexArray, " pairs"], signs: Float[Array, " pairs"]) -> Sides:
        """Return these and further decided sides.

        Parameters
        ----------
        pairs : ndarray of int, shape (n,)
            Indices of pairs.
        signs : ndarray of shape (n,)
            Their sides.

        Returns
        -------
        Sides
            All of them.
        """
        return Sides((*self.pairs, *map(int, pairs)), (*self.signs, *map(float, signs)))


@dataclass(frozen=True)
class Certificate:
    """Weights y of rows and decided pairs, and V(y), which bound filters at any sensitivity.

    Parameters
    ----------
    rows, pairs : ndarray of int
        Rows and pairs with a weight above 0.
    row_weights, pair_weights : ndarray
        Their weights.
    most : float
        V(y).
    """

    rows: Int[IndexArray, " rows"]
    row_weights: PerRow
    pairs: Int[IndexArray, " pairs"]
    pair_weights: Float[Array, " pairs"]
    most: float


@dataclass(frozen=True)
class LinearSolution:
    """Result of a linear program for a t and some sides, in the objective's unit.

    Parameters
    ----------
    beyond : float
        Upper bound on filters with these sides (-inf: there is none).
    margin : float
        Largest margin above t.
    curve : ndarray of shape (n_wavelengths,), optional
        QE of the filter with this margin.
    needs : Sides
        Sides that suffice for the bound.
    certificate : Certificate, optional
        Proof of the bound.
    """

    beyond: float
    margin: float = -np.inf
    curve: PerWavelength | None = None
    needs: Sides = Sides()
    certificate: Certificate | None = None
