"""Matrix product whose rows do not depend on each other."""

from __future__ import annotations

import numpy as np

from ..base.types import Array, Float

_FEW_TERMS = 8
"""Sums of so many products are taken one after the other, all rows at once."""
_ROWS, _LANES, _LARGE = 64, 8, 200_000
"""Rows of each product, what the number of its columns is a multiple of, and numbers of a matrix for single rows."""


def row_products(rows: Float[Array, "rows k"], matrix: Float[Array, "k others"]) -> Float[Array, "rows others"]:
    """Multiply each row by a matrix.

    BLAS sums in an order that depends on shapes, strides and the place of a row among others. In blocks of one shape,
    filled up with zeros, the sums of a row are the same alone and in any block, on one machine.
    """
    if 0 < len(matrix) <= _FEW_TERMS:
        columns = np.ascontiguousarray(rows.T)
        products = matrix[0][:, None] * columns[0]
        for at in range(1, len(matrix)):
            products += matrix[at][:, None] * columns[at]
        return np.asarray(products.T)
    if matrix.size > _LARGE:  # few rows are multiplied by so many columns
        return np.asarray(np.matmul(np.ascontiguousarray(rows)[:, None, :], matrix)[:, 0])
    n, wanted = len(rows), matrix.shape[1]
    padded = np.zeros((len(matrix), -(-wanted // _LANES) * _LANES))
    padded[:, :wanted] = matrix
    products = np.empty((n, wanted))
    for start in range(0, n, _ROWS):
        block = np.ascontiguousarray(rows[start : start + _ROWS])
        if len(block) < _ROWS:
            block = np.concatenate([block, np.zeros((_ROWS - len(block), block.shape[1]))])
        products[start : start + _ROWS] = (block @ padded)[: n - start, :wanted]
    return products
