"""The least error: of several the largest, as its number of decades below 1."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...base.types import FloatArray
from ..rule import Rule

_SMALLEST = 1e-300
"""No error is told to be less."""


class Least(Rule):
    """The largest of the terms, errors of which less is wanted: -log10 of it, so that more is better."""

    name = "least"
    smallest = True
    wanted = "less"

    def of(self, terms: FloatArray) -> FloatArray:
        """-log10 of the largest; see `Rule.of`."""
        return np.asarray(-np.log10(np.maximum(terms.max(axis=0), _SMALLEST)), dtype=float)

    def gradient(self, terms: FloatArray) -> FloatArray:
        """That of the largest one, the first of several."""
        worst = np.argmax(terms)
        slope = np.zeros(len(terms))
        slope[worst] = -1 / (np.log(10) * max(terms[worst], _SMALLEST))
        return slope

    def words(self, terms: Sequence[str]) -> str:
        """See `Rule.words`."""
        return f"-log10 of {terms[0] if len(terms) == 1 else 'the largest of ' + ', '.join(terms)}"
