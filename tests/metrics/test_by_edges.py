"""CSDs of designs by their edges, without an array of their values: those of all pairs, one by one."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from sweep.camera.electrons import ByEdges, Changing
from sweep.designs.block import EdgeBlock, EdgeSums
from sweep.metrics import compiled_edges
from sweep.metrics.separation import separation as distance_of
from sweep.metrics.separation import separations_by_edges

MEMBERS = {"a": np.array([7, 0, 3]), "b": np.array([1, 4]), "c": np.array([2, 5, 6, 8, 9])}


def changing(
    rng: np.random.Generator, n: int, spread: float, line: tuple[float, float, float, float], *, grid: bool = False
) -> Changing:
    """Designs whose changing channel is the third of four, made of drawn edges; `grid`: as a grid has them in order."""
    left, right = rng.random((2, 13, 10)) * spread
    base, own, uniform = rng.random(10) * spread, rng.random(10) * 5, rng.random(n)
    at_left, at_right, depth = rng.integers(0, 13, n), rng.integers(0, 13, n), rng.random(n)
    if grid:
        at_left, at_right = np.arange(n) // 13 % 13, np.arange(n) % 13
    fixed = np.floor(rng.random((1, 10, 4)) * min(spread * 4, 4096))
    block = EdgeBlock(None, np.arange(n), None, at_left, at_right, depth)  # type: ignore[arg-type]
    by_edges = ByEdges(EdgeSums(base, left, right), block, own, uniform, line)

    def make(part: slice) -> np.ndarray:
        electrons = ((own + (base + depth[:, None] * (left[at_left] - right[at_right]))) + uniform[:, None]) * 3.0
        top_e, gain, offset, full = line
        whole = np.floor(offset)
        dn = np.floor((np.where(electrons > top_e, top_e, electrons) * gain + (offset - whole)) + 0.5) + whole
        return np.clip(dn, 0, full)[part, None]

    return Changing(fixed, 2, make, 3.0, np.ones(n, dtype=bool), by_edges)


@pytest.mark.parametrize("n", [1, 63, 64, 65, 1000])
@pytest.mark.parametrize("spread", [1.0, 40.0, 2000.0])
@pytest.mark.parametrize("grid", [False, True])
def test_they_are_those_of_all_pairs(n: int, spread: float, grid: bool) -> None:
    """Also where all squares are beyond what half of a double's bits hold, and where many designs coincide."""
    made = changing(np.random.default_rng(n), n, spread, (9000.0, 0.41, 16.3, 4095.0), grid=grid)
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


@pytest.mark.parametrize("grid", [False, True])
def test_a_value_that_is_not_a_number_spoils_no_other_design(grid: bool) -> None:
    made = changing(np.random.default_rng(4), 300, 100.0, (9000.0, 0.41, 16.3, 4095.0), grid=grid)
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


def test_runs_of_edges_are_read_as_single_designs_are() -> None:
    """Runs that begin within the designs side by side; the same digital numbers as where every edge is drawn."""
    made = changing(np.random.default_rng(6), 64, 100.0, (9000.0, 0.41, 16.3, 4095.0), grid=True)
    assert made.by_edges is not None
    edges, block = made.by_edges, made.by_edges.block
    table = edges.sums.base, edges.sums.left, edges.sums.right, edges.sums.across
    starts = np.empty(9, dtype=np.intp)
    assert compiled_edges._runs((*table, block.at_left, block.at_right, block.depth), 0, starts) == 5
    assert starts[:6].tolist() == [0, 13, 26, 39, 52, 64]
    mixed = np.random.default_rng(7).permutation(64)
    shuffled = (*table, block.at_left[mixed], block.at_right[mixed], block.depth[mixed])
    assert compiled_edges._runs(shuffled, 0, starts) == 9
    other = replace(made, by_edges=edges._replace(block=block.some(mixed), uniform=edges.uniform[mixed]))
    found, again = separations_by_edges(made, MEMBERS), separations_by_edges(other, MEMBERS)
    assert found is not None
    assert again is not None
    for pair, distances in found.items():
        assert np.array_equal(distances[mixed], again[pair])
