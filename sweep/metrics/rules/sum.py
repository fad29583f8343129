"""The sum of the terms."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...base.types import FloatArray
from ..rule import Rule


class Sum(Rule):
    """What one term loses another may gain."""

    name = "sum"

    def of(self, terms: FloatArray) -> FloatArray:
        """The sum; see `Rule.of`."""
        return np.asarray(terms.sum(axis=0), dtype=float)

    def gradient(self, terms: FloatArray) -> FloatArray:
        """1 for each."""
        return np.ones(len(terms))

    def words(self, terms: Sequence[str]) -> str:
        """See `Rule.words`."""
        return " + ".join(terms)
