"""Compiled inner loops that put classes of pixels together to the channels of a CFA. They release the GIL."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..base.machine_code import njit
from ..base.types import FloatArray, IndexArray
from .compiled_light import add
from .compiled_patches import to_control


class CellBounds(NamedTuple):
    """What is known of classes of pixels in cells of places.

    `sizes`: how far the weighted light of each class through each class's filter, less the same share of the weights as
    at the nodes, may be from its interpolation, ndarray[n_cells, n, n, n_parts]. `nodes`: sums of the weights at the
    nodes, ndarray[n_cells, 9, n]. `moves`: how far these, times a parabola, may be from their interpolation, for the
    size of the parabola, its slope and its second derivative, ndarray[n_cells, n, 3]. `low`, `high`: range of the
    kernel over the nodes, ndarray[n_cells, n, n, n_parts].
    """

    sizes: FloatArray
    nodes: FloatArray
    moves: FloatArray
    low: FloatArray
    high: FloatArray


@njit(cache=True, nogil=True)
def kernels_of_channels(
    kernels: FloatArray, sums: FloatArray, rows: IndexArray, which: IndexArray, channel: IndexArray, out: FloatArray
) -> None:
    """Kernels of channels, ndarray[n_places, n_channels, n_channels, n_functions], from those of classes of pixels.

    `kernels`: ndarray[n, n_classes, n_classes, n_functions], `sums`: of the weights, ndarray[n, n_classes]; `rows`: the
    one of each place, ndarray[n_places]; `which`: the class there that stands for each class, ndarray[n_places,
    n_classes]; `channel`: of each class.
    """
    n_classes = channel.size
    out[:] = 0.0
    for place in range(rows.size):
        row, total = rows[place], np.zeros(out.shape[1])
        for own in range(n_classes):
            to = which[place, own]
            weight = sums[row, to]
            total[channel[own]] += weight
            for other in range(n_classes):
                through = which[place, other]
                add(out[place, channel[own], channel[other]], weight, kernels[row, to, through])
        for u in range(out.shape[1]):
            for c in range(out.shape[2]):
                of_channel = out[place, u, c]
                for k in range(of_channel.size):
                    of_channel[k] /= total[u]


@njit(cache=True, nogil=True)
def _weights_of_channels(
    bounds: CellBounds, row: int, which: IndexArray, channel: IndexArray, least: FloatArray, moves: FloatArray
) -> None:
    """Put the smallest sum of weights of each channel in a cell into `least`, and how far that sum times a parabola may
    be from its interpolation, relative to it, into `moves`, ndarray[n_channels, 3].
    """
    values, control = np.empty(9), np.empty(9)
    moves[:] = 0.0
    for own in range(channel.size):
        add(moves[channel[own]], 1.0, bounds.moves[row, which[own]])
    for u in range(least.size):
        values[:] = 0.0
        for own in range(channel.size):
            if channel[own] == u:
                add(values, 1.0, bounds.nodes[row, :, which[own]])
        to_control(values, control)
        least[u] = max(control.min() - moves[u, 0], 1e-300)
        for size in range(3):
            moves[u, size] /= least[u]


@njit(cache=True, nogil=True)
def deviations_of_channels(
    bounds: CellBounds,
    uneven: FloatArray,
    rows: IndexArray,
    which: IndexArray,
    channel: IndexArray,
    found: FloatArray,
    moves: FloatArray,
) -> None:
    """How far kernels of channels in cells may be from their interpolation: see `between.Deviation`.

    A channel's kernel k is the ratio of sums over its classes, sum M / sum D. With its interpolation i, and the mean
    over the nodes of its own ratio, r, and of that of a class, r_p, (k - i) sum D is nothing at the nodes, so that it
    is the sum over classes of dev(M - r_p D) + (r_p - r) dev(D), and dev((r - i) sum D), which `moves` is for.
    `uneven`: what pixels of a class differ in, relative to it, in how much they take of the light through each class's
    filter, ndarray[n_classes, n_classes]; the rest as for `kernels_of_channels`. `found`: ndarray[n_cells, n_channels,
    n_channels, n_parts], `moves`: ndarray[n_cells, n_channels, 3].
    """
    n_classes, n_channels, n_parts = channel.size, found.shape[1], found.shape[3]
    least = np.empty(n_channels)
    low, high = np.empty((n_classes, n_channels)), np.empty((n_classes, n_channels))
    found[:] = 0.0
    for cell in range(rows.size):
        row, here = rows[cell], which[cell]
        _weights_of_channels(bounds, row, here, channel, least, moves[cell])
        for part in range(n_parts):
            low[:], high[:] = 0.0, 0.0
            for own in range(n_classes):
                for other in range(n_classes):
                    p, q = here[own], here[other]
                    below, above = bounds.low[row, p, q, part], bounds.high[row, p, q, part]
                    low[own, channel[other]] += below
                    high[own, channel[other]] += above
                    missed = uneven[p, q] * max(abs(below), abs(above)) * bounds.moves[row, p, 0]
                    found[cell, channel[own], channel[other], part] += bounds.sizes[row, p, q, part] + missed
            for own in range(n_classes):
                u = channel[own]
                for c in range(n_channels):
                    apart = 0.0
                    for other in range(n_classes):
                        if other != own and channel[other] == u:
                            apart = max(apart, high[other, c] - low[own, c], high[own, c] - low[other, c])
                    if apart > 0:
                        apart = max(apart, high[own, c] - low[own, c])
                        found[cell, u, c, part] += apart * bounds.moves[row, here[own], 0]
        for u in range(n_channels):
            for c in range(n_channels):
                for part in range(n_parts):
                    found[cell, u, c, part] /= least[u]
