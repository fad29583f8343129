"""CSDs of designs by their edges, without an array of their values: those of all pairs, one by one."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from sweep.camera.electrons import ByEdges, Changing
from sweep.designs.block import EdgeBlock
from sweep.metrics.separation import separation as distance_of
from sweep.metrics.separation import separations_by_edges

MEMBERS = {"a": np.array([7, 0, 3]), "b": np.array([1, 4]), "c": np.array([2, 5, 6, 8, 9])}


def changing(rng: np.random.Generator, n: int, spread: float, line: tuple[float, float, float, float]) -> Changing:
    """Designs whose changing channel is the third of four, made of drawn edges."""
    left, right = rng.random((2, 13, 10)) * spread
    base, own, uniform = rng.random(10) * spread, rng.random(10) * 5, rng.random(n)
    at_left, at_right, depth = rng.integers(0, 13, n), rng.integers(0, 13, n), rng.random(n)
    fixed = np.floor(rng.random((1, 10, 4)) * min(spread * 4, 4096))
    block = EdgeBlock(None, np.arange(n), None, at_left, at_right, depth)  # type: ignore[arg-type]
    by_edges = ByEdges((base, left, right), block, own, uniform, line)

    def make() -> np.ndarray:
        electrons = ((own + (base + depth[:, None] * (left[at_left] - right[at_right]))) + uniform[:, None]) * 3.0
        top_e, gain, offset, full = line
        whole = np.floor(offset)
        dn = np.floor((np.where(electrons > top_e, top_e, electrons) * gain + (offset - whole)) + 0.5) + whole
        return np.clip(dn, 0, full)[:, None]

    return Changing(fixed, 2, make, 3.0, np.ones(n, dtype=bool), by_edges)


@pytest.mark.parametrize("n", [1, 63, 64, 65, 1000])
@pytest.mark.parametrize("spread", [1.0, 40.0, 2000.0])
def test_they_are_those_of_all_pairs(n: int, spread: float) -> None:
    """Also where all squares are beyond what half of a double's bits hold, and where many designs coincide."""
    made = changing(np.random.default_rng(n), n, spread, (9000.0, 0.41, 16.3, 4095.0))
    found = separations_by_edges(made, MEMBERS)
    assert found is not None
    for a, b in combinations(MEMBERS, 2):
        assert np.array_equal(found[a, b], distance_of(made.whole[:, 0], MEMBERS[a], MEMBERS[b]))


def test_squares_that_a_float_does_not_hold_are_summed_in_doubles() -> None:
    made = changing(np.random.default_rng(3), 200, 5.0, (np.inf, 0.41, 0.0, 4095.0))
    fixed = np.zeros((1, 10, 4))
    fixed[:, MEMBERS["a"]] = [4095, 4094, 0, 4093]
    fixed[:, MEMBERS["b"], 3] = 1
    far = replace(made, fixed=fixed)
    found = separations_by_edges(far, MEMBERS)
    assert found is not None
    assert found["a", "b"].min() ** 2 > 2**25
    for a, b in combinations(MEMBERS, 2):
        assert np.array_equal(found[a, b], distance_of(far.whole[:, 0], MEMBERS[a], MEMBERS[b]))


def test_a_value_that_is_not_a_number_spoils_no_other_design() -> None:
    made = changing(np.random.default_rng(4), 300, 100.0, (9000.0, 0.41, 16.3, 4095.0))
    assert made.by_edges is not None
    made.by_edges.uniform[[5, 64, 299]] = np.nan
    found = separations_by_edges(made, MEMBERS)
    assert found is not None
    for a, b in combinations(MEMBERS, 2):
        expected = distance_of(made.whole[:, 0], MEMBERS[a], MEMBERS[b])
        assert np.array_equal(found[a, b], expected, equal_nan=True)
        assert np.flatnonzero(np.isnan(expected)).tolist() == [5, 64, 299]


def test_more_bits_than_a_float_squares_are_left_to_doubles() -> None:
    made = changing(np.random.default_rng(5), 100, 100.0, (9000.0, 0.41, 16.3, 65_535.0))
    assert separations_by_edges(made, MEMBERS) is None
    assert made.by_edges is not None
    assert separations_by_edges(replace(made, by_edges=made.by_edges._replace(line=None)), MEMBERS) is None
