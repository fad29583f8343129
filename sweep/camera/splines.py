"""Splines through values at equidistant nodes, of thousands of functions at once."""

from __future__ import annotations

import numpy as np

from ..base.types import FloatArray


def spline_through(nodes: FloatArray, values: FloatArray, order: int) -> tuple[FloatArray, FloatArray]:
    """Knots and coefficients, ndarray[n, n_functions], of the spline of an odd order whose third (and, of the fifth
    order, fourth and fifth) knots from either end are no knots: that of SciPy's `make_interp_spline`.

    `values`: ndarray[n, n_functions] at the nodes. The matrix of B-splines at the nodes is totally positive, so that it
    needs no exchange of rows (C. de Boor and A. Pinkus, Backward error analysis for totally positive linear systems,
    1977).
    """
    from scipy.interpolate import BSpline  # noqa: PLC0415  (slow to import: kept off the start-up path)

    from .compiled_splines import solve_banded  # noqa: PLC0415  (compiled: kept off the start-up path)

    left_out = (order + 1) // 2
    inner = nodes[left_out:-left_out]
    knots = np.concatenate([np.full(order + 1, nodes[0]), inner, np.full(order + 1, nodes[-1])])
    sparse = BSpline.design_matrix(nodes, knots, order)
    row = np.repeat(np.arange(len(nodes)), np.diff(sparse.indptr))
    band = np.zeros((len(nodes), 2 * order + 1))
    band[row, order + sparse.indices - row] = sparse.data
    found = np.array(values, dtype=float, order="C")
    solve_banded(band, found)
    return knots, found
