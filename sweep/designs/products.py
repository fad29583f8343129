"""Matrix product whose rows do not depend on each other."""

from __future__ import annotations

import numpy as np

from ..base.types import Array, Float

_FEW_TERMS = 8
"""Sums of so many products are taken one after the other, all rows at once."""


def row_products(rows: Float[Array, "rows k"], matrix: Float[Array, "k others"]) -> Float[Array, "rows others"]:
    """Multiply each row by a matrix in a call of its own.

    BLAS sums in an order that depends on shapes, strides and the place of a row among others. Here the sums of a row
    are the same alone and in any block, on one machine.
    """
    if 0 < len(matrix) <= _FEW_TERMS:
        columns = np.ascontiguousarray(rows.T)
        products = matrix[0][:, None] * columns[0]
        for at in range(1, len(matrix)):
            products += matrix[at][:, None] * columns[at]
        return np.asarray(products.T)
    return np.asarray(np.matmul(np.ascontiguousarray(rows)[:, None, :], matrix)[:, 0])
