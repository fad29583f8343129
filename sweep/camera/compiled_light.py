"""Compiled inner loops of the light on pixels. They release the GIL."""

from __future__ import annotations

import math

import numpy as np

from ..base.machine_code import njit
from ..base.types import BoolArray, FloatArray, IndexArray

Table = tuple[FloatArray, float]
"""Coefficients of a uniform spline of the fifth order, ndarray[n, n_functions], from the second node before a radius of
nothing on, and nodes per pixel."""
EdgeRule = tuple[FloatArray, FloatArray]
"""Nodes between -1 and 1 and their weights."""


@njit(cache=True, nogil=True)
def _area(x: float, y: float, radius: float) -> float:
    """Signed area of the disc over the rectangle from 0 to (x, y), odd in both."""
    sign = np.sign(x) * np.sign(y)
    x, y = min(abs(x), radius), min(abs(y), radius)
    corner = math.sqrt((radius - y) * (radius + y))  # from here on the circle is lower than y
    if x <= corner:
        return float(sign * x * y)
    height = math.sqrt((radius - x) * (radius + x))
    sector = radius**2 * math.atan2(x * y - corner * height, height * y + x * corner)
    return float(sign * 0.5 * (corner * y + x * height + sector))


@njit(cache=True, nogil=True)
def covered_share(x: float, y: float, half: float, radius: float) -> float:
    """Share of a square of half side `half` around (x, y) that lies in the disc of `radius` around 0, exact."""
    x, y, squared = abs(x), abs(y), radius * radius
    if (x + half) * (x + half) + (y + half) * (y + half) <= squared:
        return 1.0
    near_x, near_y = max(x - half, 0.0), max(y - half, 0.0)
    if near_x * near_x + near_y * near_y >= squared:
        return 0.0
    area = _area(x + half, y + half, radius) - _area(x + half, y - half, radius)
    area += _area(x - half, y - half, radius) - _area(x - half, y + half, radius)
    return min(max(area / (4 * half**2), 0.0), 1.0)


@njit(cache=True, nogil=True)
def covered_shares(x: FloatArray, y: FloatArray, half: float, radius: float) -> FloatArray:
    """`covered_share` of squares, ndarray[n] each."""
    found = np.empty(x.size)
    for at in range(x.size):
        found[at] = covered_share(x[at], y[at], half, radius)
    return found


@njit(cache=True, nogil=True, fastmath={"contract"})
def fifth_order(t: float) -> tuple[float, float, float, float, float, float]:
    """The six pieces of a uniform B-spline of the fifth order, times 120, `t` of the way from one node to the next."""
    s = 1.0 - t
    t2, s2 = t * t, s * s
    return (
        s2 * s2 * s,
        1 + s * (5 + s * (10 + s * (10 + s * (5 - 5 * s)))),
        26 + s * (50 + s * (20 + s * (-20 + s * (-20 + 10 * s)))),
        26 + t * (50 + t * (20 + t * (-20 + t * (-20 + 10 * t)))),
        1 + t * (5 + t * (10 + t * (10 + t * (5 - 5 * t)))),
        t2 * t2 * t,
    )


@njit(cache=True, nogil=True, fastmath={"contract"})
def along_edge(away: float, middle: float, half: float, table: Table, rule: EdgeRule, found: FloatArray) -> None:
    """What flows through an edge that is `away` from the light's center and `half` to both sides of `middle` long."""
    coefficients, per_px = table
    nodes, weights = rule
    n = found.size
    found[:] = 0.0
    for at in range(nodes.size):
        y = middle + half * nodes[at]
        r = math.sqrt(away * away + y * y) * per_px
        first = int(r)
        share = weights[at] * half * away / 120
        a, b, c, d, e, f = fifth_order(r - first)
        a, b, c, d, e, f = a * share, b * share, c * share, d * share, e * share, f * share
        for k in range(n):
            found[k] += (
                a * coefficients[first, k]
                + b * coefficients[first + 1, k]
                + c * coefficients[first + 2, k]
                + d * coefficients[first + 3, k]
                + e * coefficients[first + 4, k]
                + f * coefficients[first + 5, k]
            )


@njit(cache=True, nogil=True, fastmath={"contract"})
def add(to: FloatArray, factor: float, values: FloatArray) -> None:
    """Add values times a factor."""
    for k in range(to.size):
        to[k] += factor * values[k]


@njit(cache=True, nogil=True)
def _blurred(
    x: FloatArray, y: FloatArray, wanted: BoolArray, half: float, table: Table, rule: EdgeRule, light: FloatArray
) -> None:
    """Put the mean of a blurred image over each pixel that is `wanted` into `light`.

    `x`: ndarray[n_columns], `y`: ndarray[n_rows]; `light`: ndarray[n_rows, n_columns, n_functions]. Pixels that touch
    share their edges.
    """
    touch = half == 0.5
    scale = 1 / (4 * half**2)
    rows, columns = wanted.shape
    flow = np.empty(light.shape[2])
    light[:] = 0.0
    for row in range(rows):
        for column in range(columns):
            if not wanted[row, column]:
                continue
            own = light[row, column]
            for side in (-1, 1):
                for turned in (False, True):  # the edges to the left and right, then those below and above
                    along, across = (y[row], x[column]) if turned else (x[column], y[row])
                    to_row, to_column = (row + side, column) if turned else (row, column + side)
                    inside = 0 <= to_row < rows and 0 <= to_column < columns
                    shared = touch and inside and wanted[to_row, to_column]
                    if shared and side < 0:
                        continue
                    along_edge(along + side * half, across, half, table, rule, flow)
                    add(own, side * scale, flow)
                    if shared:
                        add(light[to_row, to_column], -scale, flow)


@njit(cache=True, nogil=True)
def covered_by_disc(x: FloatArray, y: FloatArray, half: float, radius: float) -> FloatArray:
    """How much of each pixel a disc covers, ndarray[n, n_rows, n_columns]; `x`: ndarray[n, n_columns], `y` likewise."""
    found = np.empty((len(x), y.shape[1], x.shape[1]))
    for case in range(len(x)):
        for row in range(y.shape[1]):
            for column in range(x.shape[1]):
                found[case, row, column] = covered_share(x[case, column], y[case, row], half, radius)
    return found


@njit(cache=True, nogil=True)
def to_channels(
    values: FloatArray, channel: IndexArray, row: int, column: int, share: float, found: FloatArray
) -> bool:
    """Put what of a pixel's light is in each channel's value into `found`, neighbors' weights, too; whether any is."""
    found[:] = 0.0
    found[channel[row, column]] += (1 - share) * values[row, column]
    if share > 0:
        rows, columns = values.shape
        for to_row, to_column in ((row - 1, column), (row + 1, column), (row, column - 1), (row, column + 1)):
            if 0 <= to_row < rows and 0 <= to_column < columns:
                found[channel[to_row, to_column]] += share / 4 * values[to_row, to_column]
    some = False
    for value in found:
        some = some or value > 0
    return some


@njit(cache=True, nogil=True)
def _looked_at(
    weights: FloatArray, channel: IndexArray, share: float, n_channels: int, wanted: BoolArray
) -> FloatArray:
    """Mark the pixels of whose light something is in any value; the sum of each channel's weights."""
    total = np.zeros(n_channels)
    wanted[:] = False
    for row in range(channel.shape[0]):
        for column in range(channel.shape[1]):
            if weights[row, column] > 0:
                total[channel[row, column]] += weights[row, column]
                wanted[row, column] = True
                if share > 0:
                    wanted[row - 1, column] = wanted[row + 1, column] = True
                    wanted[row, column - 1] = wanted[row, column + 1] = True
    return total


@njit(cache=True, nogil=True)
def _folded(
    weights: FloatArray, total: FloatArray, channel: IndexArray, share: float, light: FloatArray, found: FloatArray
) -> None:
    """Put what each channel gets through each channel's filter into `found`, ndarray[n_channels, n_channels, n]."""
    found[:] = 0.0
    for row in range(channel.shape[0]):
        for column in range(channel.shape[1]):
            if weights[row, column] > 0:
                to = channel[row, column]
                weight = weights[row, column] / total[to]
                add(found[to, to], (1 - share) * weight, light[row, column])
                if share > 0:
                    for at, beside in ((row - 1, column), (row + 1, column), (row, column - 1), (row, column + 1)):
                        add(found[to, channel[at, beside]], weight * share / 4, light[at, beside])


@njit(cache=True, nogil=True)
def kernels(
    x: FloatArray,
    y: FloatArray,
    weights: FloatArray,
    channel: IndexArray,
    half: float,
    radius: float,
    share: float,
    table: Table,
    rule: EdgeRule,
    out: FloatArray,
    sums: FloatArray,
) -> None:
    """Kernels of places: what each channel gets of each function of the light through each channel's filter.

    `x`: ndarray[n_places, n_columns], `y`: ndarray[n_places, n_rows], pixels from the light's center. `weights`:
    ndarray[n_places, n_rows, n_columns] of the pixels in their channel's value, up to a factor for each channel; those
    at the border are nothing. `radius`: of the disc, which is sharp where the table has no function. `share`: of a
    pixel's light that comes through its neighbors' filters. `out`: ndarray[n_places, n_channels, n_channels,
    n_functions or 1]; `sums`: of the weights, ndarray[n_places, n_channels].
    """
    light = np.empty((*channel.shape, out.shape[3]))
    wanted = np.empty(channel.shape, dtype=np.bool_)
    for place in range(len(x)):
        total = _looked_at(weights[place], channel, share, out.shape[1], wanted)
        if table[0].shape[1]:
            _blurred(x[place], y[place], wanted, half, table, rule, light)
        else:
            for row in range(channel.shape[0]):
                for column in range(channel.shape[1]):
                    light[row, column, 0] = covered_share(x[place, column], y[place, row], half, radius)
        _folded(weights[place], total, channel, share, light, out[place])
        for u in range(total.size):
            sums[place, u] = total[u]
