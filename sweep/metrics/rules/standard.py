"""The smallest of the terms, their sum, and the least error."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...base.types import Array, Float, PerTerm, SameShape
from ..rule import Rule

_SMALLEST = 1e-300
"""No error is told to be less."""


class Least(Rule):
    """-log10 of the largest term, for errors, so that more is better."""

    name = "least"
    smallest = True
    direction = "less"

    def of(self, terms: Float[Array, " terms *batch"]) -> SameShape:
        return np.asarray(-np.log10(np.maximum(terms.max(axis=0), _SMALLEST)), dtype=float)

    def gradient(self, terms: PerTerm) -> PerTerm:
        """Return the derivative of the largest term, the first of several."""
        worst = np.argmax(terms)
        slope = np.zeros(len(terms))
        slope[worst] = -1 / (np.log(10) * max(terms[worst], _SMALLEST))
        return slope

    def words(self, terms: Sequence[str]) -> str:
        return f"-log10 of {terms[0] if len(terms) == 1 else 'the largest of ' + ', '.join(terms)}"


class Minimum(Rule):
    """The smallest term."""

    name = "minimum"
    smallest = True

    def of(self, terms: Float[Array, " terms *batch"]) -> SameShape:
        return np.asarray(terms.min(axis=0), dtype=float)

    def gradient(self, terms: PerTerm) -> PerTerm:
        """Return 1 for the smallest term, the first of several."""
        return np.asarray(np.arange(len(terms)) == np.argmin(terms), dtype=float)

    def words(self, terms: Sequence[str]) -> str:
        return f"smallest of {', '.join(terms)}"


class Sum(Rule):
    """Sum of the terms."""

    name = "sum"

    def of(self, terms: Float[Array, " terms *batch"]) -> SameShape:
        return np.asarray(terms.sum(axis=0), dtype=float)

    def gradient(self, terms: PerTerm) -> PerTerm:
        return np.ones(len(terms))

    def words(self, terms: Sequence[str]) -> str:
        return " + ".join(terms)
