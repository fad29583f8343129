"""A product whose rows do not depend on their company."""

from __future__ import annotations

import numpy as np

from ..types import FloatArray

_ROWS = 16


def row_products(rows: FloatArray, matrix: FloatArray) -> FloatArray:
    """`rows @ matrix`, in which the same row gives the same bits alone and in any block.

    `rows`: ndarray[n, k]; `matrix`: ndarray[k, m]. BLAS sums in an order that depends on shapes and strides. So rows
    are multiplied in groups of one size, the last one filled up with zeros.
    """
    n, k = rows.shape
    rows = np.ascontiguousarray(rows)
    whole = n - n % _ROWS
    found = np.empty((n, matrix.shape[1]), dtype=np.result_type(rows, matrix))
    np.matmul(rows[:whole].reshape(-1, _ROWS, k), matrix, out=found[:whole].reshape(-1, _ROWS, matrix.shape[1]))
    if whole < n:
        filled = np.zeros((_ROWS, k), dtype=rows.dtype)
        filled[: n - whole] = rows[whole:]
        found[whole:] = (filled @ matrix)[: n - whole]
    return found
