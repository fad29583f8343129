"""Color separation distance and sensitivity."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

import numpy as np

from ..base.cache import Cache
from ..base.types import BoolArray, FloatArray, IndexArray
from ..camera.electrons import Changing
from ..curves.lights import Pair, class_pairs, pair_name

_BLOCK_PAIRS = 262_144
"""Pair distances held at once per channel: 2 MiB, so that a block stays in cache."""
_MANY, _MOST_CHANNELS = 64, 4
"""From so many designs of so few channels on, the compiled pass saves more time than it takes to load."""
_SMALLEST = 1e-140
"""Distances below this, and above its inverse, are computed without squares."""
_NEVER_INFINITE = 1e150
"""Sums and products of a few numbers below this are finite."""


def csd_name(pair: Pair) -> str:
    """Column name of a pair's color separation distance, in DN."""
    return pair_name("csd", pair)


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
    one, other = _all_pairs(first, second)
    step = max(1, _BLOCK_PAIRS // max(1, one.size * shape[2]))
    for start in range(0, shape[0], step):
        yield slice(start, min(start + step, shape[0])), one, other


def _all_pairs(first: IndexArray, second: IndexArray) -> tuple[IndexArray, IndexArray]:
    """Both signal indices of every pair."""
    return np.repeat(first, len(second)), np.tile(second, len(first))


def separations(response: FloatArray, members: Mapping[str, IndexArray]) -> dict[Pair, FloatArray]:
    """CSD of every pair of signal types; `members` maps a type to its signal indices. Shapes as in `separation`."""
    n_designs, _, n_channels = response.shape
    pairs = class_pairs(list(members))
    if n_designs < _MANY or n_channels > _MOST_CHANNELS or not np.isfinite(response).all():
        return {(a, b): separation(response, members[a], members[b]) for a, b in pairs}
    from .nearest import nearest_squared  # noqa: PLC0415  (compiled: kept off the start-up path)

    order, bounds = _in_order(members)
    filled = np.zeros((n_designs, _MOST_CHANNELS, order.size))
    filled[:, :n_channels] = np.moveaxis(response[:, order], 1, 2)
    squared = np.empty((n_designs, len(pairs)))
    nearest_squared(filled, bounds, squared)
    return _distances(squared.T, members, lambda doubtful: response[doubtful])


def separations_along(
    fixed: FloatArray, channel: int, values: FloatArray, members: Mapping[str, IndexArray]
) -> dict[Pair, FloatArray]:
    """`separations` of designs that differ in one channel alone.

    `fixed`: ndarray[n_signals, n_channels], DN, what they share in the others; `values`: ndarray[n_designs, n_signals],
    that of `channel`.
    """

    def whole(some: IndexArray | slice) -> FloatArray:
        response = np.repeat(fixed[None], len(values[some]), axis=0)
        response[..., channel] = values[some]
        return response

    others = np.delete(fixed, channel, axis=1)
    if not np.isfinite(others).all():
        return separations(whole(slice(None)), members)
    apart = pairs_apart(others, members)
    squared, faulty = _nearest_along(values, apart)
    return _mended(_distances(squared, members, whole), faulty, whole, members)


def separations_by_edges(changing: Changing, members: Mapping[str, IndexArray]) -> dict[Pair, FloatArray] | None:
    """`separations_along` of designs by their edges, without an array of their values; None where that will not do."""
    edges, others = changing.by_edges, np.delete(changing.fixed[0], changing.channel, axis=1)
    if edges is None or edges.line is None or not np.isfinite(others).all():
        return None
    from .compiled_edges import MOST_DN, nearest_by_edges  # noqa: PLC0415  (compiled: kept off the start-up path)

    if edges.line[-1] > MOST_DN:
        return None
    apart, block = pairs_apart(others, members), edges.block
    squared, faulty = np.empty((len(apart.starts) - 1, len(block))), np.zeros(len(block), dtype=bool)
    sums = edges.sums
    table = sums.base, sums.left, sums.right, sums.across, block.at_left, block.at_right, block.depth
    exposed = edges.fixed, edges.uniform, changing.exposure_s
    # A NaN compares with nothing, and is not below.
    finite = all(np.abs(part).max() < _NEVER_INFINITE for part in (edges.fixed, edges.uniform, block.depth))
    finite = finite and sums.largest < _NEVER_INFINITE
    nearest_by_edges(table, exposed, edges.line, finite, *apart, squared, faulty)

    def whole(some: IndexArray | slice) -> FloatArray:
        return np.asarray(changing.whole[some, 0])

    return _mended(_distances(squared, members, whole), faulty, whole, members)


def _mended(
    found: dict[Pair, FloatArray],
    faulty: BoolArray,
    whole: Callable[[IndexArray], FloatArray],
    members: Mapping[str, IndexArray],
) -> dict[Pair, FloatArray]:
    """The distances; again those of designs with a value that is not finite, which changes no other design."""
    bad = np.flatnonzero(faulty)
    if bad.size:
        for pair, distance in separations(whole(bad), members).items():
            found[pair][bad] = distance
    return found


class Apart(NamedTuple):
    """Pairs of signals as `nearest_along_squared` takes them, sorted by their distance in the channels they share."""

    order: IndexArray
    fixed: FloatArray
    first: IndexArray
    second: IndexArray
    starts: IndexArray


def _nearest_along(values: FloatArray, apart: Apart) -> tuple[FloatArray, BoolArray]:
    """`out` and `bad` of `nearest.nearest_along_squared`, of few designs without what is compiled: the same sums."""
    if len(values) < _MANY:
        own = values[:, apart.order]
        with np.errstate(invalid="ignore", over="ignore"):
            differences = own[:, apart.first] - own[:, apart.second]
            squares = apart.fixed + differences * differences
        return np.minimum.reduceat(squares, apart.starts[:-1], axis=1).T, np.any(~np.isfinite(values), axis=1)
    from .nearest import nearest_along_squared  # noqa: PLC0415  (compiled: kept off the start-up path)

    squared, faulty = np.empty((len(apart.starts) - 1, len(values))), np.zeros(len(values), dtype=bool)
    nearest_along_squared(np.ascontiguousarray(values), *apart, squared, faulty)
    return squared, faulty


_apart: Cache[bytes, Apart] = Cache(16)
"""The blocks of a run share their fixed channels."""


def pairs_apart(others: FloatArray, members: Mapping[str, IndexArray]) -> Apart:
    """Pairs of signals of two types; `others`: ndarray[n_signals, n_channels], DN, the channels that designs share."""

    def made() -> Apart:
        order, _ = _in_order(members)
        place = np.empty(order.max() + 1, dtype=np.uint32)  # of each signal in the order of the classes
        place[order] = np.arange(order.size)
        nearest: list[tuple[FloatArray, IndexArray, IndexArray]] = []
        for a, b in class_pairs(list(members)):
            one, other = _all_pairs(members[a], members[b])
            apart = ((others[one] - others[other]) ** 2).sum(axis=1)
            rank = np.argsort(apart, kind="stable")
            nearest.append((apart[rank], place[one[rank]], place[other[rank]]))
        starts = np.cumsum([0, *(len(apart) for apart, _, _ in nearest)])
        apart, one, other = (np.concatenate(parts) for parts in zip(*nearest, strict=True))
        return Apart(order, apart, one, other, starts)

    own = [np.array([len(others), *map(len, members.values())]), *members.values(), np.ascontiguousarray(others)]
    return _apart.get(hashlib.sha256(b"".join(part.tobytes() for part in own)).digest(), made)


def _in_order(members: Mapping[str, IndexArray]) -> tuple[IndexArray, IndexArray]:
    """All signals, one type after the other, and where each begins."""
    own = list(members.values())
    return np.concatenate(own), np.cumsum([0, *(len(signals) for signals in own)])


def _distances(
    squared: FloatArray, members: Mapping[str, IndexArray], response: Callable[[IndexArray], FloatArray]
) -> dict[Pair, FloatArray]:
    """Roots of `squared`, ndarray[n_pairs, n_designs].

    Distances whose squares a float does not hold well are computed again, without squares.
    """
    found = {}
    for (a, b), row in zip(class_pairs(list(members)), squared, strict=True):
        distance = np.sqrt(row)
        if distance.size and not (distance.min() >= _SMALLEST and distance.max() <= 1 / _SMALLEST):
            doubtful = np.flatnonzero((distance < _SMALLEST) | (distance > 1 / _SMALLEST))
            if doubtful.size:
                distance[doubtful] = _nearest(response(doubtful), members[a], members[b], _add_leg)
        found[a, b] = distance
    return found


def cfa_sensitivity(total_qe: FloatArray, counts: IndexArray, clear_qe: FloatArray) -> FloatArray:
    """Total QE, averaged over the pixels of the tile, divided by that of the clear pixel.

    `total_qe`: ndarray[..., n_channels], QE summed over the wavelengths; `counts`: pixels per tile of each channel. 1
    means a sensor without color filters. Returns ndarray[...].
    """
    weighted = np.moveaxis(total_qe * counts, -1, 0)
    mean = sum(weighted[1:], start=weighted[0]) / counts.sum()  # few channels of many designs
    return np.asarray(mean / clear_qe.sum(dtype=float), dtype=float)
