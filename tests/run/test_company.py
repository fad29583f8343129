"""A design's numbers are the same, within rounding, alone, in any block, beside any other design, on both routes."""

from __future__ import annotations

import numpy as np
import pytest

from sweep.designs.products import row_products

from ..cases import thinned


@pytest.mark.parametrize(("k", "m"), thinned([(7, 3), (1, 1), (61, 51), (301, 1), (301, 51), (301, 2000), (602, 102)]))
def test_products_of_rows(k: int, m: int) -> None:
    """Every row is multiplied by the same call, so that its bits are those that it has alone."""
    rng = np.random.default_rng(k + m)
    rows, matrix = rng.random((150, k)), rng.random((k, m))
    whole = row_products(rows, matrix)
    # An error of at most k roundings of a sum of positive numbers.
    exact = rows.astype(np.longdouble) @ matrix.astype(np.longdouble)
    assert (np.abs(whole - exact) <= k * np.finfo(float).eps * exact).all()
    np.testing.assert_array_equal(row_products(np.asfortranarray(rows), matrix), whole)
    for n in (0, 1, 2, 15, 16, 17, 40, 149):
        np.testing.assert_array_equal(row_products(rows[:n], matrix), whole[:n])
        np.testing.assert_array_equal(row_products(rows[1 : 1 + n : 2], matrix), whole[1 : 1 + n : 2])
