"""A design's numbers are the same, within rounding, alone, in any block, beside any other design, on both routes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sweep.camera.model import SceneModel
from sweep.camera.setup import Setup
from sweep.designs.block import edges_of
from sweep.designs.products import row_products
from sweep.metrics.evaluate import evaluate

from ..blocks import SPACE, VIEWS
from ..cases import thinned
from ..rounding import assert_within_rounding, brightest_dn


def assert_same(found: dict[str, Any], which: Any, alone: dict[str, Any], setup: Setup, magnitude_dn: float) -> None:
    assert list(found) == list(alone)
    for name, values in alone.items():
        assert_within_rounding(name, found[name][which], values, setup, magnitude_dn)


@pytest.mark.parametrize("separable", [True, False])
def test_a_bad_design_changes_no_other_beyond_rounding(separable: bool) -> None:
    imager = SceneModel(VIEWS["saturated" if separable else "chart"])  # one exposure for all; one that the design sets
    fine = edges_of(SPACE, 0, SPACE.size)
    assert fine is not None
    bad = np.array([0, 17, 30])
    others = np.delete(np.arange(SPACE.size), bad)
    if separable:
        depth = fine.depth.copy()
        depth[bad] = np.nan
        spoiled: Any = replace(fine, depth=depth)
    else:
        spoiled = fine.curves()
        spoiled[bad] = np.nan
    whole, found = (evaluate(imager, block) for block in (fine if separable else fine.curves(), spoiled))
    alone = {name: values[others] for name, values in whole.items()}
    assert_same(found, others, alone, imager.setup, brightest_dn(imager.setup, fine.curves()))
    assert np.isnan(found["csd_yellow_red"][bad]).all()


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
    for at in range(len(rows)):
        np.testing.assert_array_equal(row_products(rows[at : at + 1], matrix)[0], whole[at])
    for n in (0, 2, 15, 16, 17, 40, 149):
        np.testing.assert_array_equal(row_products(rows[:n], matrix), whole[:n])
        np.testing.assert_array_equal(row_products(rows[1 : 1 + n : 2], matrix), whole[1 : 1 + n : 2])
