"""A product whose rows do not depend on their company."""

from __future__ import annotations

import numpy as np

from ..base.types import FloatArray

_FEW_TERMS = 8
"""Sums of so many products are taken one after the other, all rows at once."""


def row_products(rows: FloatArray, matrix: FloatArray) -> FloatArray:
    """`rows @ matrix`, each row by the same call: on one machine its sums are the same alone and in any block.

    `rows`: ndarray[n, k]; `matrix`: ndarray[k, m]. BLAS sums in an order that depends on shapes, strides and, on some
    processors, a row's place among others. So every row is multiplied by itself. On another machine, or by another
    route, sums are equal to rounding.
    """
    if 0 < len(matrix) <= _FEW_TERMS:
        columns = np.ascontiguousarray(rows.T)
        found = matrix[0][:, None] * columns[0]
        for at in range(1, len(matrix)):
            found += matrix[at][:, None] * columns[at]
        return np.asarray(found.T)
    return np.asarray(np.matmul(np.ascontiguousarray(rows)[:, None, :], matrix)[:, 0])
