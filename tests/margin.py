"""d' of two signals by its definition, a search over the share l of one side, which has no code in common."""

from __future__ import annotations

import numpy as np

_GOLDEN = (5**0.5 - 1) / 2


def squared_dprime(difference: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """4 r^2, r^2 the largest sum of D^2 / (Va / l + Vb / (1 - l)) over the last axis; it is concave in l."""
    spreads = np.broadcast_arrays(first, second, difference)[:2]

    def at(share: np.ndarray) -> np.ndarray:
        noise = spreads[0] / share[..., None] + spreads[1] / (1 - share[..., None])
        return 4 * (difference**2 / np.maximum(noise, 1e-300)).sum(axis=-1)

    low, high = (np.full(spreads[0].shape[:-1], end) for end in (1e-9, 1 - 1e-9))
    for _ in range(60):
        one, two = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
        rises = at(one) < at(two)
        low, high = np.where(rises, one, low), np.where(rises, high, two)
    return at((low + high) / 2)


def near_squared_dprime(
    difference: np.ndarray, first: np.ndarray, second: np.ndarray, most: float = np.inf
) -> np.ndarray:
    """4 r^2 of signals that may be the nearest ones, and up to `most`; of others that with l = 1/2, which is no more."""
    difference, first, second = np.broadcast_arrays(difference, first, second)
    squared = (difference**2 * 2 / (first + second)).sum(axis=-1)
    least = np.unravel_index(squared.argmin(), squared.shape)
    near = squared < min(squared_dprime(difference[least], first[least], second[least]), most)
    near[least] = True
    squared[near] = squared_dprime(difference[near], first[near], second[near])
    return squared
