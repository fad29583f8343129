"""Color separation distance (CSD) and CFA sensitivity."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..base.cache import Cache
from ..base.types import (
    Array,
    Bool,
    BoolArray,
    DesignSignals,
    Float,
    FloatArray,
    IndexArray,
    Int,
    MemberNumbers,
    PerChannel,
    PerDesign,
    SameShape,
)
from ..camera.mosaic import Mosaic
from ..spectra.lights import Pair, class_pairs, pair_name

_BLOCK_PAIRS = 262_144
"""Pair distances held at once per channel: 2 MiB, so that a block stays in cache."""
MANY, MOST_CHANNELS = 64, 4
"""From so many designs of so few channels on, compiled passes save more time than they take to load."""
_LARGEST = 1e140
"""Larger distances, and those below its inverse, are scaled before they are squared, DN."""


def csd_name(pair: Pair) -> str:
    """Return the column name of a pair's CSD."""
    return pair_name("csd", pair)


def pixel_roots(mosaic: Mosaic) -> PerChannel:
    """Return the roots of how many of four pixels each channel has: factors of readings in which every pixel counts."""
    return np.asarray(np.sqrt(4 * mosaic.counts / mosaic.counts.sum()))


def separation(
    response: DesignSignals, first: Int[IndexArray, " first"], second: Int[IndexArray, " second"]
) -> PerDesign:
    """Compute the color separation distance of two signal types (the paper's CSD), DN.

    The smallest L2 distance between a point of one type and a point of the other. Differences are taken before
    squares, so that nearly coincident points at large offsets lose no digits.
    """
    response = np.asarray(response, dtype=float)
    distances = np.empty(len(response))
    step = max(1, _BLOCK_PAIRS // max(1, len(first) * len(second)))
    for start in range(0, len(response), step):
        block = response[start : start + step]
        total = np.zeros((len(block), len(first), len(second)))
        with np.errstate(over="ignore"):
            for channel in range(response.shape[2]):
                values = block[:, :, channel]
                total += (values[:, first, None] - values[:, None, second]) ** 2
        distances[start : start + step] = np.sqrt(total.min(axis=(1, 2)))
    odd = np.flatnonzero(~((distances >= 1 / _LARGEST) & (distances <= _LARGEST)))
    if odd.size:
        from .separation_kernels import nearest_scaled  # noqa: PLC0415  (compiled: kept off the start-up path)

        scaled = np.empty(odd.size)
        nearest_scaled(response[odd], first, second, scaled)
        distances[odd] = scaled
    return distances


def pair_blocks(
    shape: tuple[int, ...], first: Int[IndexArray, " first"], second: Int[IndexArray, " second"]
) -> Iterator[tuple[slice, Int[IndexArray, " _pairs"], Int[IndexArray, " _pairs"]]]:
    """Yield blocks of designs that are small enough for all pairs at once."""
    first_of_pair, second_of_pair = np.repeat(first, len(second)), np.tile(second, len(first))
    step = max(1, _BLOCK_PAIRS // max(1, first_of_pair.size * shape[2]))
    for start in range(0, shape[0], step):
        yield slice(start, min(start + step, shape[0])), first_of_pair, second_of_pair


def separations(response: DesignSignals, members: Mapping[str, MemberNumbers]) -> dict[Pair, PerDesign]:
    """Compute the CSD of every pair of signal types, DN."""
    n_designs, pairs = len(response), class_pairs(list(members))
    packed = packed_response(response, members)
    if packed is None:
        return {(a, b): separation(response, members[a], members[b]) for a, b in pairs}
    from .separation_kernels import nearest_squared  # noqa: PLC0415  (compiled: kept off the start-up path)

    squared = np.empty((n_designs, len(pairs)))
    nearest_squared(*packed, squared)
    return _distances(squared.T, np.zeros(n_designs, dtype=bool), members, lambda designs: response[designs])


def packed_response(
    response: DesignSignals, members: Mapping[str, MemberNumbers]
) -> tuple[Float[Array, "designs 4 signals"], Int[IndexArray, " _types"]] | None:
    """Return a response in the layout of the compiled kernels.

    Returns `response`: one type after the other; missing channels are 0; `bounds`: start of each type. None in place of
    both for few designs, more channels, or values that are not finite.
    """
    n_designs, _, n_channels = response.shape
    if n_designs < MANY or n_channels > MOST_CHANNELS or not np.isfinite(response).all():
        return None
    order = np.concatenate(list(members.values()))
    packed = np.zeros((n_designs, MOST_CHANNELS, order.size))
    packed[:, :n_channels] = np.moveaxis(response[:, order], 1, 2)
    return packed, np.cumsum([0, *map(len, members.values())])


def separations_along(
    fixed: Float[Array, "signals channels"],
    channel: int,
    values: Float[Array, "designs signals"],
    members: Mapping[str, MemberNumbers],
) -> dict[Pair, PerDesign]:
    """Compute the CSD of every pair for designs that differ in one channel alone, DN.

    `fixed`: shared channels, DN; `values`: values of that channel, DN.
    """
    others, pairs = np.delete(fixed, channel, axis=1), class_pairs(list(members))
    odd = np.asarray(~np.isfinite(values).all(axis=1) | (not np.isfinite(others).all()))
    order = pair_order(_squared, others, members, pairs)
    from .separation_kernels import nearest_along_squared  # noqa: PLC0415  (compiled: kept off the start-up path)

    squared = np.empty((len(pairs), len(values)))
    of_pairs = order.least, order.first, order.second, order.starts
    nearest_along_squared(np.ascontiguousarray(values), *of_pairs, squared)

    def all_channels(designs: Bool[BoolArray, " values"]) -> DesignSignals:
        response = np.repeat(fixed[None], int(designs.sum()), axis=0)
        response[..., channel] = values[designs]
        return response

    return _distances(squared, odd, members, all_channels)


def _distances(
    squared: Float[Array, "pairs designs"],
    odd: Bool[BoolArray, " designs"],
    members: Mapping[str, MemberNumbers],
    response: Callable[[Bool[BoolArray, "designs signals channels"]], DesignSignals],
) -> dict[Pair, PerDesign]:
    """Return the roots; non-finite designs and too large squares by `separation`."""
    distances = dict(zip(class_pairs(list(members)), np.sqrt(squared), strict=True))
    for (a, b), distance in distances.items():
        recomputed = odd | ~((distance >= 1 / _LARGEST) & (distance <= _LARGEST))
        if recomputed.any():
            distance[recomputed] = separation(response(recomputed), members[a], members[b])
    return distances


@dataclass(frozen=True)
class PairOrder:
    """Pairs of signals of two types each, type by type from `starts`, those that may be nearest first.

    `least`: what no squared distance of a pair is below, ascending within each pair of types.
    """

    first: Int[IndexArray, " pairs"]
    second: Int[IndexArray, " pairs"]
    starts: Int[IndexArray, " types"]
    least: Float[Array, " pairs"]


_orders: Cache[bytes, PairOrder] = Cache(16)
"""The blocks of a run share their fixed channels."""
_SquaredDistance = Callable[[FloatArray, FloatArray], FloatArray]


def pair_order(
    squared: _SquaredDistance,
    others: Float[Array, "signals channels"],
    members: Mapping[str, MemberNumbers],
    pairs: Sequence[Pair],
) -> PairOrder:
    """Return the pairs of signals by their squared distance in the shared channels, DN^2."""

    def compute() -> PairOrder:
        parts = []
        for a, b in pairs:
            first, second = np.repeat(members[a], len(members[b])), np.tile(members[b], len(members[a]))
            with np.errstate(invalid="ignore", over="ignore"):
                least = squared(others[first], others[second])
            rank = np.argsort(least, kind="stable")
            parts.append((first[rank], second[rank], least[rank]))
        starts = np.cumsum([0, *(len(first) for first, *_ in parts)])
        first, second, least = (np.concatenate(columns) for columns in zip(*parts, strict=True))
        return PairOrder(first, second, starts, least)

    sizes = [len(of_type) for of_type in members.values()]
    key = [repr((squared.__name__, pairs, sizes)).encode(), *map(bytes, members.values()), others.tobytes()]
    return _orders.get(hashlib.sha256(b"".join(key)).digest(), compute)


def _squared(first: Float[Array, "pairs channels"], second: Float[Array, "pairs channels"]) -> Float[Array, " pairs"]:
    return np.asarray(((first - second) ** 2).sum(axis=1), dtype=float)


def cfa_sensitivity(
    total_qe: Float[Array, "*batch channels"],
    counts: Int[IndexArray, " channels"],
    total_clear: Float[Array, ""] | float,
) -> SameShape:
    """Return the integral of the QE, averaged over the pixels of the tile, relative to that of the clear pixel.

    `counts`: pixels of each channel per tile. 1 for a sensor without color filters.
    """
    weighted = np.moveaxis(total_qe * counts, -1, 0)
    mean = sum(weighted[1:], start=weighted[0]) / counts.sum()  # few channels of many designs
    return np.asarray(mean / total_clear, dtype=float)
