"""The smallest of the terms."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...base.types import FloatArray
from ..rule import Rule


class Minimum(Rule):
    """As good as its worst term."""

    name = "minimum"
    smallest = True

    def of(self, terms: FloatArray) -> FloatArray:
        """The smallest; see `Rule.of`."""
        return np.asarray(terms.min(axis=0), dtype=float)

    def gradient(self, terms: FloatArray) -> FloatArray:
        """1 for the smallest, the first one of several."""
        return np.asarray(np.arange(len(terms)) == np.argmin(terms), dtype=float)

    def words(self, terms: Sequence[str]) -> str:
        """See `Rule.words`."""
        return f"smallest of {', '.join(terms)}"
