"""Compiled inner loops of images: drawn digital numbers, and their likelihood."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..base.machine_code import njit

_MARGIN = 50.0
"""Cases less likely than the most likely by more than this logarithm of a factor count as impossible."""
_LOOK = 16


@njit(cache=True, nogil=True)
def draw_numbers(
    node: NDArray[np.int32],
    share: NDArray[np.float32],
    below: NDArray[np.float32],
    uniform: NDArray[np.float64],
    out: NDArray[np.int16],
) -> None:
    """Compute the digital number up to which a share `uniform` of all lies.

    `uniform`: random numbers, 0 to 1.
    """
    last = below.shape[1] - 1
    for i in range(node.size):
        lower, upper, w, u = below[node[i]], below[node[i] + 1], share[i], uniform[i]
        low, high = 0, last
        while low < high:
            middle = (low + high) // 2
            if lower[middle] * (1 - w) + upper[middle] * w >= u:
                high = middle
            else:
                low = middle + 1
        out[i] = low


@njit(cache=True, nogil=True)
def cases_on_table(
    unlit: NDArray[np.float64],
    phantoms: NDArray[np.float64],
    lamps: NDArray[np.float64],
    cases: NDArray[np.intp],
    candelas: NDArray[np.float64],
    orders: NDArray[np.intp],
    nodes_e: NDArray[np.float64],
    node_of_root: NDArray[np.int32],
    step: float,
    node: NDArray[np.int32],
    share: NDArray[np.float32],
) -> None:
    """Compute `PixelTable.at` of the expected electrons of all cases.

    `cases`: type of the lit lens or -1, signal, order, phantom, place; `candelas`: luminous intensity, cd.
    """
    last = node_of_root.size - 1
    for case in range(len(cases)):
        kind, lamp, order, sunny, place = cases[case]
        for p in range(unlit.shape[1]):
            electrons = unlit[place, p]
            for position in range(orders.shape[1]):
                kind_here = orders[order, position]
                if sunny:
                    electrons += phantoms[place, position, kind_here, p]
                if kind_here == kind:
                    electrons += candelas[case] * lamps[place, position, lamp, p]
            below = node_of_root[min(int(np.sqrt(electrons) / step), last)]
            part = (electrons - nodes_e[below]) / (nodes_e[below + 1] - nodes_e[below])
            node[case, p] = below
            share[case, p] = min(max(part, 0.0), 1.0)


@njit(cache=True, nogil=True)
def log_likelihoods(
    numbers: NDArray[np.int16],
    node: NDArray[np.int32],
    share: NDArray[np.float32],
    table: NDArray[np.float32],
    out: NDArray[np.float64],
) -> None:
    """Write the log-likelihood of each case given each image into `out`, from tabulated probabilities.

    `node`, `share`: result of `PixelTable.at`, pixels with most information first; `table`: `PixelTable.shares`, none
    above 0. -inf for cases that are impossible beside the best.
    """
    n_pixels = numbers.shape[1]
    for image in range(numbers.shape[0]):
        best = -np.inf
        for case in range(node.shape[0]):
            total = 0.0
            for p in range(n_pixels):
                row, i = table[numbers[image, p]], node[case, p]
                total += row[i] + share[case, p] * (row[i + 1] - row[i])
                if p % _LOOK == 0 and total < best - _MARGIN:
                    total = -np.inf
                    break
            out[image, case] = total
            best = max(best, total)
