"""Compiled inner loops of images: drawn digital numbers, and their likelihood."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...base.machine_code import njit

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


@njit(cache=True, nogil=True, inline="always")
def _mixed(counter: np.uint64) -> np.uint64:
    """Return a random number of 64 bits (SplitMix64: Steele, Lea, Flood, OOPSLA 2014)."""
    z = counter * np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


@njit(cache=True, nogil=True)
def draw_crops(
    parts: tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]],
    heads: NDArray[np.int32],
    light: NDArray[np.float32],
    orders: NDArray[np.intp],
    nodes_e: NDArray[np.float32],
    node_of_root: NDArray[np.int32],
    step: float,
    below: NDArray[np.float32],
    guide: NDArray[np.int16],
    scaled: NDArray[np.float32],
    key: int,
    out: NDArray[np.float32],
) -> None:
    """Draw the crops of heads, each with photons of its own: a node of the pixel's table, then a number of it.

    `parts`: electrons of unlit heads by place and background, of the sun by place, position and type, and of lamps by
    place, position and signal, per unit of `light`; `heads`: type of the lit lens or -1, signal, order, sun, place,
    background; `guide`: first number at each share of a node's distribution; `scaled`: value of each number.
    """
    unlit, phantoms, lamps = parts
    n_pixels, n_guides, last = unlit.shape[2], guide.shape[1], node_of_root.size - 1
    inverse, unit, half = np.float32(1 / step), np.float32(2.0**-23), np.float32(0.5)
    electrons = np.empty(n_pixels, dtype=np.float32)
    for image in range(len(heads)):
        kind, lamp, order, sunny, place, background = heads[image]
        electrons[:] = unlit[place, background]
        for position in range(orders.shape[1]):
            here = orders[order, position]
            if sunny:
                electrons += phantoms[place, position, here]
            if here == kind:
                electrons += light[image] * lamps[place, position, lamp]
        start = _mixed(np.uint64(key) + np.uint64(image)) & np.uint64(0xFFFFFFFFFFFF0000)
        for p in range(n_pixels):
            node = node_of_root[min(int(np.sqrt(electrons[p]) * inverse), last)]
            share = (electrons[p] - nodes_e[node]) / (nodes_e[node + 1] - nodes_e[node])
            bits = _mixed(start + np.uint64(p))
            node += (np.float32(bits & np.uint64(0x7FFFFF)) + half) * unit < share
            u = (np.float32(bits >> np.uint64(41)) + half) * unit
            number = guide[node, int(u * n_guides)]
            while below[node, number] < u:
                number += 1
            out[image, p] = scaled[number]


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
