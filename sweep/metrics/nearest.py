"""Compiled inner loops: distances of pairs, without an array per step.

NumPy has to write every difference of every pair to memory; these keep them in registers and leave out the pairs that
cannot be the nearest. They release the GIL and are compiled once per machine (Numba's cache). Sums keep their order, so
that results are those of the same sums in NumPy.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from ..types import FloatArray, IndexArray

_NUMBERS = {"nnan", "nsz"}
"""Lets the compiler take the smaller of several numbers at once; callers hand in no NaN."""
CHANNELS = 4
"""Channels that `nearest_squared` takes; fewer are filled up with zeros."""


@njit(cache=True, nogil=True, fastmath=_NUMBERS)
def nearest_squared(response: FloatArray, bounds: IndexArray, out: FloatArray) -> None:
    """Smallest squared distance of each pair of classes.

    `response`: C-ordered ndarray[n_designs, CHANNELS, n_signals], finite, one class of signals after the other;
    `bounds`: ndarray[n_classes + 1], where each class begins. `out`: ndarray[n_designs, n_pairs], pairs in the order of
    `curves.lights.class_pairs`.
    """
    for d in range(response.shape[0]):
        values = response[d]
        pair = 0
        for a in range(bounds.size - 1):
            for b in range(a + 1, bounds.size - 1):
                best = np.inf
                for i in range(bounds[a], bounds[a + 1]):
                    m0, m1, m2, m3 = values[0, i], values[1, i], values[2, i], values[3, i]
                    nearest = np.inf
                    for j in range(bounds[b], bounds[b + 1]):
                        x0, x1, x2, x3 = m0 - values[0, j], m1 - values[1, j], m2 - values[2, j], m3 - values[3, j]
                        squared = x0 * x0 + x1 * x1 + x2 * x2 + x3 * x3
                        nearest = min(nearest, squared)
                    best = min(best, nearest)
                out[d, pair] = best
                pair += 1


@njit(cache=True, nogil=True, fastmath=_NUMBERS)
def nearest_along_squared(
    values: FloatArray,
    bounds: IndexArray,
    fixed: FloatArray,
    first: IndexArray,
    second: IndexArray,
    starts: IndexArray,
    out: FloatArray,
) -> None:
    """The same for designs that differ in one channel alone.

    `values`: ndarray[n_designs, n_signals], that channel. `fixed`: squared distances in the other channels, sorted
    within each pair of classes; `first`, `second`: the signals of each; `starts`: where each pair of classes begins.
    A pair of classes is done when what is left, with the gap between the classes in `values`, is no nearer.
    """
    classes = bounds.size - 1
    low, high = np.empty(classes), np.empty(classes)
    for d in range(values.shape[0]):
        mine = values[d]
        for c in range(classes):
            least, most = np.inf, -np.inf
            for s in range(bounds[c], bounds[c + 1]):
                least = min(least, mine[s])
                most = max(most, mine[s])
            low[c], high[c] = least, most
        pair = 0
        for a in range(classes):
            for b in range(a + 1, classes):
                gap = max(0.0, low[a] - high[b], low[b] - high[a])
                gap *= gap
                best = np.inf
                for k in range(starts[pair], starts[pair + 1]):
                    if fixed[k] + gap >= best:
                        break
                    apart = mine[first[k]] - mine[second[k]]
                    squared = fixed[k] + apart * apart
                    best = min(best, squared)
                out[d, pair] = best
                pair += 1
