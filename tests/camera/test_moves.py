"""Bounds on pairs of signals: NumPy's for a few cells and the compiled ones for many are the same."""

import numpy as np
import pytest

from sweep.camera.plan import compiled, moves
from sweep.camera.plan.moves import Parts


def drawn(rng: np.random.Generator, n_cases: int, n_cells: int, n_signals: int, n_pairs: int) -> Parts:
    return (
        rng.normal(size=(n_cases, 4, n_signals)) * 100,
        rng.random((n_cases, 4, n_pairs)) * rng.choice([0.0, 1.0, 300.0]),
        rng.random((n_cells, 4, n_pairs)) * rng.choice([0.0, 10.0]),
    )


@pytest.mark.parametrize("seed", range(30))
def test_both_ways_find_the_same(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n_cases, n_cells, n_corners, n_signals, n_pairs = rng.integers([1, 1, 1, 2, 2], [9, 7, 10, 12, 40])
    first, second = rng.integers(0, n_signals, (2, n_pairs))
    corners = rng.integers(0, n_cases, (n_cells, n_corners))
    ends = np.array([0, rng.integers(0, n_pairs + 1), n_pairs])
    change, after = (drawn(rng, n_cases, n_cells, n_signals, n_pairs) for _ in range(2))
    far = moves.longest_moves(change, corners, first, second)
    np.testing.assert_allclose(far, compiled.moves_of_cells(change, corners, first, second), rtol=1e-14)
    for least in (0.0, float(np.median(far)), float(far.max()) + 1):
        given = (far * 0.1, after, corners, first, second, ends, rng.random(), least)
        assert moves.largest_change(*given) == pytest.approx(compiled.change_of_cells(*given), rel=1e-14)


def test_many_cells_are_left_to_machine_code(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(0)
    first, second = np.triu_indices(51, 1)
    change = drawn(rng, 9, 200, 51, first.size)
    corners = rng.integers(0, 9, (200, 9))
    called = []
    monkeypatch.setattr(compiled, "moves_of_cells", lambda *given: called.append(given) or np.zeros((200, first.size)))
    moves.longest_moves(change, corners, first, second)
    moves.longest_moves((*change[:2], change[2][:1]), corners[:1], first, second)
    assert len(called) == 1
