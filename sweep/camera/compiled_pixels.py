"""Compiled inner loops of the light of whole pixels of a blurred round image. They release the GIL."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..base.machine_code import njit
from ..base.types import FloatArray, IndexArray
from .compiled_light import EdgeRule, Table, add, along_edge, fifth_order, to_channels


class Rings(NamedTuple):
    """The mean over a pixel of a round image, as a function of where the pixel's center is: rings of a pixel's width.

    In each, it is a sum of a few functions of the radius times cos(4 k angle). `coefficients`: of uniform splines of
    the fifth order, from the second node before the ring's first on, ndarray[n_rings, n_nodes, n_harmonics, n];
    `shares`: how much of each function of the image is in each of the ring's, ndarray[n_rings, n, n_functions];
    `starts`: node at which each begins; `per_px`: nodes per pixel.
    """

    coefficients: FloatArray
    shares: FloatArray
    starts: IndexArray
    per_px: float


@njit(cache=True, nogil=True)
def means_on_rays(
    radii: FloatArray, angles: FloatArray, half: float, table: Table, rule: EdgeRule, found: FloatArray
) -> None:
    """Put the mean over a pixel whose center is at a radius and an angle into `found`, ndarray[n_radii, n_angles,
    n_functions]: the sum over its edges (`encircled`).
    """
    flow = np.empty(found.shape[2])
    scale = 1 / (4 * half**2)
    found[:] = 0.0
    for at in range(radii.size):
        for ray in range(angles.size):
            x, y = radii[at] * math.cos(angles[ray]), radii[at] * math.sin(angles[ray])
            for side in (-1, 1):
                along_edge(x + side * half, y, half, table, rule, flow)
                add(found[at, ray], side * scale, flow)
                along_edge(y + side * half, x, half, table, rule, flow)
                add(found[at, ray], side * scale, flow)


@njit(cache=True, nogil=True, fastmath={"contract"})
def _mean_over_pixel(x: float, y: float, rings: Rings, light: FloatArray) -> int:
    """Put the mean over a pixel around (x, y) into `light`, by the functions of its ring; which ring that is."""
    squared = x * x + y * y
    r = math.sqrt(squared)
    ring = min(int(r), rings.starts.size - 1)
    cosine = 2 * x * x / squared - 1 if squared > 0 else 1.0
    cosine = 2 * cosine * cosine - 1  # of four times the angle
    at = r * rings.per_px
    first = int(at)
    a, b, c, d, e, f = fifth_order(at - first)
    own = rings.coefficients[ring, first - rings.starts[ring] :]
    before, harmonic = cosine, 1.0  # cosines of -1, 0 and 1 times the angle
    light[:] = 0.0
    for k in range(own.shape[1]):
        for at_function in range(light.size):
            light[at_function] += (harmonic / 120) * (
                a * own[0, k, at_function]
                + b * own[1, k, at_function]
                + c * own[2, k, at_function]
                + d * own[3, k, at_function]
                + e * own[4, k, at_function]
                + f * own[5, k, at_function]
            )
        before, harmonic = harmonic, 2 * cosine * harmonic - before
    return ring


@njit(cache=True, nogil=True)
def kernels_by_ring(
    x: FloatArray,
    y: FloatArray,
    weights: FloatArray,
    channel: IndexArray,
    share: float,
    rings: Rings,
    found: FloatArray,
    sums: FloatArray,
) -> None:
    """`compiled_light.kernels` of a blurred image, pixel by pixel, by the functions of each ring.

    `found`: ndarray[n_places, n_channels, n_channels, n_rings, n], which is nothing before.
    """
    n_channels = found.shape[1]
    light, own = np.empty(found.shape[4]), np.empty(n_channels)
    for place in range(len(x)):
        sums[place] = 0.0
        for row in range(channel.shape[0]):
            for column in range(channel.shape[1]):
                to = channel[row, column]
                sums[place, to] += weights[place, row, column]
                if to_channels(weights[place], channel, row, column, share, own):
                    ring = _mean_over_pixel(x[place, column], y[place, row], rings, light)
                    for u in range(n_channels):
                        if own[u] > 0:
                            add(found[place, u, to, ring], own[u], light)
