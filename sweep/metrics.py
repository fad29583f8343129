"""Color separation distance and sensitivity."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import combinations

import numpy as np

from .arrays import FloatArray, IndexArray

Pair = tuple[str, str]
CSD = "csd_"
"""How the name of a color separation distance begins."""
_BLOCK_PAIRS = 262_144
"""Pair distances held at once per channel: 2 MiB, so that a block stays in cache."""
_SMALLEST = 1e-140
"""Distances below this, and above its inverse, are computed without squares."""


def class_pairs(classes: Sequence[str]) -> tuple[Pair, ...]:
    """All unordered pairs of signal types, in the order of `classes`."""
    return tuple(combinations(classes, 2))


def csd_name(pair: Pair) -> str:
    """Column name of a pair's color separation distance, in DN."""
    return f"{CSD}{pair[0]}_{pair[1]}"


def separation(response: FloatArray, first: IndexArray, second: IndexArray) -> FloatArray:
    """Color separation distance of two signal types for a block of designs.

    `response`: ndarray[n_designs, n_signals, n_channels], DN. `first`, `second`: signal indices of the two types.
    Returns ndarray[n_designs], DN: the smallest L2 distance between a point of one and a point of the other (the
    paper's CSD). Differences are taken before squares, so nearly coincident points at large offsets lose no digits.
    """
    response = np.asarray(response, dtype=float)
    found = np.sqrt(_nearest(response, first, second, _add_square))
    doubtful = np.flatnonzero((found < _SMALLEST) | (found > 1 / _SMALLEST))
    found[doubtful] = _nearest(response[doubtful], first, second, _add_leg)
    return found


def _add_square(total: FloatArray, difference: FloatArray) -> None:
    np.multiply(difference, difference, out=difference)
    np.add(total, difference, out=total)


def _add_leg(total: FloatArray, difference: FloatArray) -> None:
    """For lengths whose squares would be too small or too large for a float."""
    np.hypot(total, difference, out=total)


def _nearest(
    response: FloatArray, first: IndexArray, second: IndexArray, add: Callable[[FloatArray, FloatArray], None]
) -> FloatArray:
    """Smallest over all pairs of what `add` collects over the channels' differences, in blocks of designs and pairs."""
    n_designs, _, n_channels = response.shape
    found = np.full(n_designs, np.inf)
    most = max(1, _BLOCK_PAIRS // max(1, len(second)))
    for at in range(0, len(first), most):
        some = first[at : at + most]
        step = max(1, _BLOCK_PAIRS // max(1, len(some) * len(second)))
        for start in range(0, n_designs, step):
            block = response[start : start + step]
            total = np.zeros((len(block), len(some), len(second)))
            with np.errstate(over="ignore"):
                for channel in range(n_channels):
                    values = block[:, :, channel]
                    add(total, values[:, some, None] - values[:, None, second])
            found[start : start + step] = np.minimum(found[start : start + step], total.min(axis=(1, 2)))
    return found


def pair_blocks(
    shape: tuple[int, ...], first: IndexArray, second: IndexArray
) -> Iterator[tuple[slice, IndexArray, IndexArray]]:
    """Blocks of designs small enough for all pairs at once: their slice, and both signal indices of every pair.

    `shape`: (n_designs, n_signals, n_channels).
    """
    one, other = np.repeat(first, len(second)), np.tile(second, len(first))
    step = max(1, _BLOCK_PAIRS // max(1, one.size * shape[2]))
    for start in range(0, shape[0], step):
        yield slice(start, min(start + step, shape[0])), one, other


def separations(response: FloatArray, members: Mapping[str, IndexArray]) -> dict[Pair, FloatArray]:
    """CSD of every pair of signal types; `members` maps a type to its signal indices. Shapes as in `separation`."""
    return {(a, b): separation(response, members[a], members[b]) for a, b in class_pairs(list(members))}


def channel_sensitivity(qe: FloatArray, reference_qe: FloatArray) -> FloatArray:
    """Total QE over the grid divided by that of the reference: ndarray[..., n_wavelengths] -> ndarray[...].

    The paper's sensitivity of a modified channel N, with the channel that it replaces (Y) as the reference.
    """
    return np.asarray(qe.sum(axis=-1, dtype=float) / reference_qe.sum(dtype=float), dtype=float)


def cfa_sensitivity(qe: FloatArray, counts: IndexArray, clear_qe: FloatArray) -> FloatArray:
    """Total QE, averaged over the pixels of the tile, divided by that of the clear pixel.

    `qe`: ndarray[..., n_channels, n_wavelengths]; `counts`: pixels per tile of each channel. 1 means a sensor without
    color filters. Returns ndarray[...].
    """
    mean = (qe.sum(axis=-1, dtype=float) * counts).sum(axis=-1) / counts.sum()
    return np.asarray(mean / clear_qe.sum(dtype=float), dtype=float)
