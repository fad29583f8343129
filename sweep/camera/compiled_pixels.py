"""Compiled inner loops of the light of whole pixels of a blurred round image. They release the GIL."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..base.machine_code import njit
from ..base.types import BoolArray, FloatArray, IndexArray
from .compiled_light import EdgeRule, Table, fifth_order, to_channels


class Rings(NamedTuple):
    """The mean over a pixel of a round image, as a function of where the pixel's center is: rings of a pixel's width.

    In each, it is a sum of a few functions of the radius times cos(4 k angle). `coefficients`: of uniform splines of
    the fifth order, from the second node before the ring's first on: all rings one after the other, of each its nodes,
    harmonics and functions. `sizes`: of each ring, where its coefficients begin, its first node, its harmonics and
    functions, and how many functions the rings before have, ndarray[n_rings, 5]. `shares`: how much of each function of
    the image is in each of the rings', ndarray[n, n_functions]. `per_px`: nodes per pixel.
    """

    coefficients: FloatArray
    sizes: IndexArray
    shares: FloatArray
    per_px: float


@njit(cache=True, nogil=True, fastmath={"contract"})
def _fold_edge(
    away: float, middle: float, half: float, per_px: float, rule: EdgeRule, start: int, folded: FloatArray
) -> None:
    """Add how much of each coefficient of a table, from `start` on, flows through an edge to `folded`, ndarray[n]: see
    `along_edge`.
    """
    nodes, weights = rule
    for at in range(nodes.size):
        y = middle + half * nodes[at]
        r = math.sqrt(away * away + y * y) * per_px
        first = int(r)
        share = weights[at] * half * away / 120
        a, b, c, d, e, f = fifth_order(r - first)
        at_first = first - start
        folded[at_first] += a * share
        folded[at_first + 1] += b * share
        folded[at_first + 2] += c * share
        folded[at_first + 3] += d * share
        folded[at_first + 4] += e * share
        folded[at_first + 5] += f * share


@njit(cache=True, nogil=True, fastmath={"contract"})
def means_on_rays(
    radii: FloatArray, angles: FloatArray, half: float, table: Table, rule: EdgeRule, found: FloatArray
) -> None:
    """Put the mean over a pixel whose center is at a radius and an angle into `found`, ndarray[n_radii, n_angles,
    n_functions]: the sum over its edges (`encircled`).

    How much there is of each coefficient is summed first, so that for the functions a product is left.
    """
    coefficients, per_px = table
    scale = 1 / (4 * half**2)
    corner = 2**0.5 * half * per_px
    folded = np.empty((angles.size, int(2 * corner) + 9))
    for at in range(radii.size):
        start = min(max(int(radii[at] * per_px - corner) - 1, 0), len(coefficients) - folded.shape[1])
        folded[:] = 0.0
        for ray in range(angles.size):
            x, y, own = radii[at] * math.cos(angles[ray]), radii[at] * math.sin(angles[ray]), folded[ray]
            for side in (-1, 1):  # light flows out of the one edge and in through the other
                _fold_edge(side * x + half, y, half, per_px, rule, start, own)
                _fold_edge(side * y + half, x, half, per_px, rule, start, own)
        np.dot(scale * folded, coefficients[start : start + folded.shape[1]], found[at])


@njit(cache=True, nogil=True, fastmath={"contract"})
def _sum_pieces(coefficients: FloatArray, start: int, n: int, t: float, found: FloatArray) -> None:
    """Put the values of splines of the fifth order, whose coefficients at one node after the other are given, `t` of
    the way from one node to the next into `found`, ndarray[n].
    """
    a, b, c, d, e, f = fifth_order(t)
    own = coefficients[start : start + 6 * n]
    one, two, three, four, five, six = own[:n], own[n:], own[2 * n :], own[3 * n :], own[4 * n :], own[5 * n :]
    for k in range(n):
        found[k] = a * one[k] + b * two[k] + c * three[k] + d * four[k] + e * five[k] + f * six[k]


@njit(cache=True, nogil=True, fastmath={"contract"})
def _sum_harmonics(values: FloatArray, harmonics: int, n: int, cosine: float, light: FloatArray) -> None:
    """Put the sum of harmonics, ndarray[n] each, by the cosines of multiples of an angle into `light`."""
    before, harmonic = cosine / 120, 1 / 120  # of -1 times and of 0 times the angle
    for at in range(n):
        light[at] = harmonic * values[at]
    for k in range(1, harmonics):
        before, harmonic = harmonic, 2 * cosine * harmonic - before
        own = values[k * n :]
        for at in range(n):
            light[at] += harmonic * own[at]


@njit(cache=True, nogil=True, fastmath={"contract"})
def _add_some(found: FloatArray, weight: float, light: FloatArray, n: int) -> None:
    """Add the first `n` values times a weight."""
    for at in range(n):
        found[at] += weight * light[at]


@njit(cache=True, nogil=True)
def kernels_by_ring(
    x: FloatArray,
    y: FloatArray,
    weights: FloatArray,
    channel: IndexArray,
    left_out: BoolArray,
    share: float,
    rings: Rings,
    first_ring: int,
    pairs: IndexArray,
    found: FloatArray,
    sums: FloatArray,
) -> None:
    """`compiled_light.kernels` of a blurred image, pixel by pixel, by the functions of each ring.

    `left_out`: pixels whose light does not count, ndarray[n_rows, n_columns]; the others are in rings from `first_ring`
    on. `found`: ndarray[n_places, n_pairs, n], of the functions of these, which is nothing before; `pairs`: which of it
    each channel's light through each channel's filter is, ndarray[n_channels, n_channels].
    """
    coefficients, sizes, per_px = rings.coefficients, rings.sizes, rings.per_px
    n_channels, last = len(pairs), len(sizes) - 1
    most, before = 0, sizes[first_ring, 4]
    for ring in range(len(sizes)):
        most = max(most, sizes[ring, 2] * sizes[ring, 3])
    light, values, own = np.empty(most), np.empty(most), np.empty(n_channels)
    sums[:] = 0.0
    for place in range(len(x)):
        mine = weights[place]
        for row in range(channel.shape[0]):
            for column in range(channel.shape[1]):
                to = channel[row, column]
                sums[place, to] += mine[row, column]
                if left_out[row, column] or not to_channels(mine, channel, row, column, share, own):
                    continue
                along, across = x[place, column], y[place, row]
                squared = along * along + across * across
                r = math.sqrt(squared)
                cosine = 2 * along * along / squared - 1 if squared > 0 else 1.0
                ring, first = min(int(r), last), int(r * per_px)
                harmonics, n = sizes[ring, 2], sizes[ring, 3]
                start = sizes[ring, 0] + (first - sizes[ring, 1]) * harmonics * n
                _sum_pieces(coefficients, start, harmonics * n, r * per_px - first, values)
                _sum_harmonics(values, harmonics, n, 2 * cosine * cosine - 1, light)
                for u in range(n_channels):
                    if own[u] > 0:
                        _add_some(found[place, pairs[u, to], sizes[ring, 4] - before :], own[u], light, n)
