"""Gauss-Legendre rules, each made once: finding the nodes of a long one takes milliseconds."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..base.types import FloatArray


@lru_cache(maxsize=64)
def rule(order: int) -> tuple[FloatArray, FloatArray]:
    """Nodes between -1 and 1 and their weights, ndarray[order] each, not to be written."""
    nodes, weights = np.polynomial.legendre.leggauss(order)
    return nodes, weights
