"""Distribution of the mean merged value of HDR pixels whose first usable capture counts, by exact sums."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from ...base.types import Array, Float, FloatArray, IndexArray, Int, PerValue
from ..pixel import Pixel
from .merge import saturating_e
from .merged_readings import readings_of


def merged_numbers(
    electrons: Float[Array, "captures designs signals pixels"],
    light: Float[Array, "captures pixels"],
    channels: Sequence[Int[IndexArray, " _pixels"]],
    pixel: Pixel,
) -> tuple[
    Int[IndexArray, " numbers"],
    Int[IndexArray, " _parts"],
    Float[Array, " _rows"],
    Int[IndexArray, "_numbers _captures signals"],
]:
    """Return the distributions of the mean merged value of the pixels of channels.

    `electrons`: expected electrons of each pixel; `light`: light of exposures relative to that of a pixel of full
    sensitivity. Returns as in `confusion`: first bin, start and roots of the shares of each distinct signal, and the
    row of each design's signal in each channel.
    """
    firsts, shares, rows = list[int](), list[FloatArray](), list[IndexArray]()
    electrons = np.minimum(electrons, np.reshape(saturating_e(pixel), (-1, 1, 1, 1)))
    for of_channel in channels:
        lights = {tuple(light[:, at]) for at in of_channel}
        assert len(lights) == 1
        of_light = lights.pop()
        signals = np.moveaxis(electrons[..., of_channel], 0, -1)  # [n_designs, n_signals, n_pixels, n_exposures]
        order = np.lexsort(np.moveaxis(signals, -1, 0), axis=-1)
        flat = np.take_along_axis(signals, order[..., None], axis=2).reshape(-1, *signals.shape[2:])
        distinct, which = np.unique(flat, axis=0, return_inverse=True)
        rows.append(which.reshape(signals.shape[:2]) + len(firsts))
        for pixels in distinct:
            first, distribution = _channel(pixels, pixel, of_light)
            firsts.append(first)
            shares.append(distribution)
    starts = np.concatenate([[0], np.cumsum([of.size for of in shares])]).astype(np.intp)
    return np.array(firsts, dtype=np.intp), starts, np.sqrt(np.concatenate(shares)), np.stack(rows)


@lru_cache(maxsize=4096)
def _pixel(electrons: tuple[float, ...], pixel: Pixel, light: tuple[float, ...]) -> tuple[int, PerValue]:
    """Return first bin and shares of one pixel; cached, since CFAs share channels."""
    from .kernels import merged_shares  # noqa: PLC0415  (compiled: kept off the start-up path)

    table = readings_of(pixel, light)
    arrays = table.exposure, table.passed, table.starts, table.columns, table.shares
    first, shares = merged_shares(np.array(electrons), pixel.prnu, *arrays, table.n_bins)
    return first + table.first, shares


def _channel(pixels: Float[Array, "signals pixels"], pixel: Pixel, light: tuple[float, ...]) -> tuple[int, PerValue]:
    """Return first bin and shares of the mean of independent pixels."""
    from .error_kernels import mean_shares  # noqa: PLC0415  (compiled: kept off the start-up path)

    parts, bins = [_pixel(tuple(expected), pixel, light) for expected in pixels], readings_of(pixel, light).bins
    low, chance = parts[0]
    # Means of values in the middle of bins, sorted into bins.
    for at, (first, shares) in enumerate(parts[1:], 1):
        value, other = (bins.value(np.arange(of.size) + begin) for of, begin in ((chance, low), (shares, first)))
        ends = [(value[k] * at + other[k]) / (at + 1) for k in (0, -1)]
        low, last = (int(number) for number in bins.number(np.array(ends)))
        edges = bins.value(np.arange(low + 0.5, last))
        chance = mean_shares(value, chance, other, shares, edges, at)
    return low, chance
