"""A product whose rows do not depend on their company."""

from __future__ import annotations

import numpy as np

from ..base.types import FloatArray


def row_products(rows: FloatArray, matrix: FloatArray) -> FloatArray:
    """`rows @ matrix`, in which the same row gives the same bits alone and in any block.

    `rows`: ndarray[n, k]; `matrix`: ndarray[k, m]. BLAS sums in an order that depends on shapes, strides and, on some
    processors, a row's place among others. So every row is multiplied by itself, by the same call.
    """
    return np.asarray(np.matmul(np.ascontiguousarray(rows)[:, None, :], matrix)[:, 0])
