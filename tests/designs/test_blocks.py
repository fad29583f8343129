"""Dense and separable blocks: the same designs by two routes; compiled pair distances against brute force."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import trapezoid
from scipy.spatial.distance import cdist

from sweep.camera.model import SceneModel
from sweep.designs.block import CurveBlock, edges_of
from sweep.designs.families.free_form import FreeForm
from sweep.designs.families.stopband import MultiStopband
from sweep.designs.space import Filter, Space
from sweep.metrics.evaluate import evaluate
from sweep.metrics.separation import class_pairs, separations, separations_along

from ..blocks import AXES, SPACE, VIEWS
from ..hard.scenes import GRID, SENSOR
from ..rounding import assert_within_rounding, brightest_dn

EPS = np.finfo(float).eps


@pytest.mark.parametrize("name", list(VIEWS))
def test_both_routes_say_the_same(name: str) -> None:
    setup = VIEWS[name]
    edges = edges_of(SPACE, 3, 69)
    assert edges is not None
    dense = evaluate(SceneModel(setup), CurveBlock(edges.curves()))
    fast = evaluate(SceneModel(setup), edges)
    assert list(fast) == list(dense)
    magnitude_dn = brightest_dn(setup, edges.curves())
    for column, values in dense.items():
        assert_within_rounding(column, fast[column], values, setup, magnitude_dn)


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.floats(380, 820), min_size=1, max_size=3),
    st.lists(st.floats(380, 820), min_size=1, max_size=3),
    st.lists(st.sampled_from([0.0, 1.0, 7.0, 40.0, 400.0]), min_size=1, max_size=3),
    st.lists(st.floats(0, 1), min_size=1, max_size=2),
)
def test_shapes_of_edges_are_those_of_their_curves(
    left: list[float], right: list[float], width: list[float], depth: list[float]
) -> None:
    # Crossed, steep and wide edges, some beyond the ends of the grid.
    grid = replace(SPACE, axes=tuple(map(tuple, (left, width, right, width, depth))))
    edges = edges_of(grid, 0, grid.size)
    assert edges is not None
    base = SENSOR.qe["Y"][None]
    curves = edges.curves()[:, 0]
    steepest, lowest = edges.shapes(base)
    np.testing.assert_allclose(steepest, np.abs(np.diff(curves)).max(axis=1), rtol=0, atol=4 * EPS)
    kept = base[0] > 0
    np.testing.assert_allclose(lowest, (curves[:, kept] / base[0, kept]).min(axis=1), rtol=1e-12, atol=4 * EPS)


def test_designs_that_set_the_exposure_take_the_dense_route() -> None:
    # Crossed edges lift N above Y, which sets the exposure then.
    crossed = replace(SPACE, axes=((690.0, 600.0), (5.0,), (410.0, 650.0), (5.0,), (0.5, 1.0)))
    edges = edges_of(crossed, 0, crossed.size)
    assert edges is not None
    imager = SceneModel(VIEWS["chart"])
    changing = imager.along(edges)
    assert changing is not None
    found, dense = evaluate(imager, edges), evaluate(imager, edges.curves())
    brighter = trapezoid(edges.curves()[:, 0]) > trapezoid(SENSOR.qe["Y"])
    np.testing.assert_array_equal(changing.which, ~brighter)
    assert 0 < np.count_nonzero(brighter) < len(brighter)
    assert np.ptp(found["exposure_s"]) > 0
    magnitude_dn = brightest_dn(imager.setup, edges.curves())
    assert_within_rounding(
        "csd_yellow_red", found["csd_yellow_red"], dense["csd_yellow_red"], imager.setup, magnitude_dn
    )
    every = imager.along(edges.subset(np.flatnonzero(brighter)))
    assert every is None


def test_the_separable_route_refuses_inseparable_curves() -> None:
    two = MultiStopband(GRID.nodes_nm, SENSOR.qe["Y"], SENSOR.qe["G"], bands=2)
    free = FreeForm(GRID.nodes_nm, SENSOR.qe["Y"], np.array([500.0, 600.0]))
    for family, axes in ((two, AXES + AXES), (free, ((0.5,), (0.5,)))):
        assert edges_of(Space("sweep", "x", "RYNCy", Filter(family, {"N": "Y"}, ""), axes), 0, 1) is None
    assert edges_of(Space("reference", "RGGB", "RGGB"), 0, 1) is None
    assert edges_of(replace(SPACE, gridded=False), 0, 1) is None


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.integers(1, 9), min_size=2, max_size=5),
    st.integers(1, 6),
    st.integers(1, 150),
    st.integers(0, 2**32 - 1),
)
def test_pair_distances_are_the_definition(sizes: list[int], channels: int, designs: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    total = sum(sizes)
    order = rng.permutation(total)
    ends = np.cumsum([0, *sizes])
    members = {f"type {i}": order[a:b] for i, (a, b) in enumerate(pairwise(ends))}
    fixed = rng.uniform(0, 4095, (total, channels))
    changing = int(rng.integers(channels))
    values = np.floor(rng.uniform(0, 4095, (designs, total)))
    values[rng.random(values.shape) < 0.01] = np.nan  # what is no number stays one
    response = np.repeat(fixed[None], designs, axis=0)
    response[..., changing] = values
    along = separations_along(fixed, changing, values, members)
    whole = separations(response, members)
    for a, b in class_pairs(list(members)):
        brute = [cdist(one[members[a]], one[members[b]]).min() for one in response]
        np.testing.assert_allclose(whole[a, b], brute, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(along[a, b], brute, rtol=1e-12, atol=1e-12)
