"""Chromatic distance of two signals: the distance that is left when either lamp may have any brightness.

For responses y1 and y2 to the lamps alone (less black level, dark current and background) it is the smaller of
min |y1 - a y2| and min |a y1 - y2| over a > 0. At an angle t of less than 90 degrees that is min(|y1|, |y2|) sin t,
otherwise min(|y1|, |y2|). The parallelogram |y1|^2 |y2|^2 sin^2 t is summed from the 2 x 2 determinants of the
channels (Lagrange's identity), so that nearly parallel responses lose no digits.

That holds while readings are linear in the light; `brightness` has what holds where pixels fill or captures merge.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from ..base.types import Array, DesignSignals, Float, IndexArray, Int, MemberNumbers, PerChannel, PerDesign, SameShape
from ..camera.brightness import LampSlopes
from ..camera.noise.law import STEPS_DN2
from ..spectra.lights import Pair, class_pairs
from .brightness import EXACT, BrightnessCurves
from .complex_step import Smooth
from .discrimination import dprime
from .separation import MOST_CHANNELS, packed_response, pair_blocks, pair_order
from .smooth import Rows, SmoothDesign

_ROUNDED = 1 - 1e-9
"""More than rounding takes off a squared distance, so that which pairs are left out changes no bit of it."""
_SEEN = 4.0
"""A search sees the nearest points of pairs whose squared distance is at most so many times the smallest, and others at
the darkest point of the curve, which is no nearer."""


def parallelogram(first: Smooth, second: Smooth) -> Smooth:
    """Return the squared area of the parallelogram of two vectors.

    Returns |first|^2 |second|^2 sin^2 of their angle.
    """
    total = np.zeros(np.broadcast_shapes(first.shape, second.shape)[:-1], dtype=np.result_type(first, second))
    for i in range(first.shape[-1]):
        for j in range(i + 1, first.shape[-1]):
            total += (first[..., i] * second[..., j] - first[..., j] * second[..., i]) ** 2
    return total


def squared_distance(first: Float[Array, "*batch channels"], second: Float[Array, "*batch channels"]) -> SameShape:
    """Return the squared chromatic distance of two vectors.

    `first`, `second`: responses less those without lamps. 0 for a vector of zeros.
    """
    lengths = [_sum(vector * vector) for vector in (first, second)]
    smaller, larger = np.minimum(*lengths), np.maximum(*lengths)
    area = parallelogram(first, second)
    beyond = _sum(first * second) <= 0
    return np.where(beyond, smaller, np.divide(area, larger, out=np.zeros_like(area), where=larger != 0))


def _sum(values: Float[Array, "*batch channels"]) -> SameShape:
    """Return the sum over the channels, in their order."""
    total = values[..., 0].copy()
    for channel in range(1, values.shape[-1]):
        total += values[..., channel]
    return total


def chromatic_separation(
    response: DesignSignals, first: Int[IndexArray, " first"], second: Int[IndexArray, " second"]
) -> PerDesign:
    """Compute the smallest chromatic distance of two signal types, DN.

    `response`: readout less that without lamps, DN.
    """
    smallest = np.empty(len(response))
    for block, first_of_pair, second_of_pair in pair_blocks(response.shape, first, second):
        smallest[block] = squared_distance(response[block][:, first_of_pair], response[block][:, second_of_pair]).min(
            axis=1
        )
    return np.sqrt(smallest)


def chromatic_separations(response: DesignSignals, members: Mapping[str, MemberNumbers]) -> dict[Pair, PerDesign]:
    """Compute the smallest chromatic distance of every pair of signal types, DN.

    `response`: readout less that without lamps, DN.
    """
    pairs = class_pairs(list(members))
    packed = packed_response(response, members)
    if packed is None:
        return {(a, b): chromatic_separation(response, members[a], members[b]) for a, b in pairs}
    from .separation_kernels import nearest_chromatic_squared  # noqa: PLC0415  (compiled: kept off the start-up path)

    squared = np.empty((len(response), len(pairs)))
    nearest_chromatic_squared(*packed, squared)
    return dict(zip(pairs, np.sqrt(squared.T), strict=True))


def chromatic_along(
    fixed: Float[Array, "signals channels"],
    channel: int,
    values: Float[Array, "designs signals"],
    unlit: Float[Array, "designs channels"],
    members: Mapping[str, MemberNumbers],
    pairs: Sequence[Pair],
) -> dict[Pair, PerDesign]:
    """Compute the smallest chromatic distance of pairs for designs that differ in one channel alone, DN.

    `fixed`: shared channels, DN, whose response without lamps is the same, too; `values`: values of that channel, DN;
    `unlit`: without lamps, DN.
    """
    shared = np.delete(fixed - unlit[0], channel, axis=1)
    finite = np.isfinite(values).all() and np.isfinite(shared).all()
    if fixed.shape[1] > MOST_CHANNELS or not finite:
        response = np.repeat(fixed[None], len(values), axis=0)
        response[..., channel] = values
        return {(a, b): chromatic_separation(response - unlit[:, None], members[a], members[b]) for a, b in pairs}
    from .separation_kernels import nearest_chromatic_along  # noqa: PLC0415  (compiled: kept off the start-up path)

    padded = np.zeros((len(fixed), MOST_CHANNELS - 1))
    padded[:, : shared.shape[1]] = shared
    order, squared = pair_order(_least, padded, members, pairs), np.empty((len(pairs), len(values)))
    of_pairs, dark = (order.first, order.second, order.starts, order.least), np.ascontiguousarray(unlit[:, channel])
    nearest_chromatic_along(np.ascontiguousarray(values), dark, padded, *of_pairs, squared)
    return dict(zip(pairs, np.sqrt(squared), strict=True))


def _least(first: Float[Array, "pairs channels"], second: Float[Array, "pairs channels"]) -> Float[Array, " pairs"]:
    """Return what no squared chromatic distance with one more channel is below, but for rounding."""
    return squared_distance(first, second) * _ROUNDED


def chromatic_rows(
    design: SmoothDesign, *, pairs: Sequence[Pair], noise: bool, decades: bool = False, per_pixel: bool = False
) -> Rows:
    """Return rows of each two signals, in every case of the scene: squared chromatic distances in both orders.

    The smallest row is the squared distance, each smooth. In closed form where readings are linear, by the nearest
    point of the brightness curve elsewhere; that point moves with the design, which adds nothing to the derivative.

    `noise`: in units of the noise, otherwise in DN; `decades`: return -log10 of the errors of Gaussians at these
    distances; `per_pixel`: with every pixel counted.
    """
    if not noise and design.linear_over_brightness:
        return _closed_rows(design, pairs, design.roots if per_pixel else 1.0)
    parts = []
    of_cases = design.over_brightness_by_pixel if per_pixel else design.over_brightness
    for number, (lamps, curves) in enumerate(of_cases):
        for pair in pairs:
            first, second = (design.setup.members[kind] for kind in pair)
            key = f"{'noise' if noise else 'pixels' if per_pixel else 'DN'} of {' and '.join(pair)} in case {number}"
            parts.append(design.cached(key, partial(_nearest_rows, lamps, curves, first, second, noise=noise)))
    rows = Rows.joined(parts)
    return rows.gaussian_decades() if decades else rows


def _nearest_rows(
    lamps: LampSlopes,
    curves: BrightnessCurves,
    first: Int[IndexArray, " first"],
    second: Int[IndexArray, " second"],
    *,
    noise: bool,
) -> Rows:
    """Return squared distances of readings from the nearest points of curves."""
    near = curves.nearest(first, second, noise=noise, margin=_SEEN, polished=_SEEN)
    factor, active = np.full(near.factor.size, curves.darkest), near.squared <= _SEEN * near.squared.min()
    factor[active] = curves.settled(near.subset(active), noise=noise)
    of_reading = lamps.moments(near.reading, np.ones(near.reading.size))
    of_curve = lamps.moments(near.curve, factor)

    (mean, variance, by_mean, by_variance), (mean_2, variance_2, by_mean_2, by_variance_2) = of_reading, of_curve
    apart = mean - mean_2, by_mean - by_mean_2
    if noise:
        spreads = [
            (np.maximum(values, STEPS_DN2), np.where(values > STEPS_DN2, slopes, 0.0))
            for values, slopes in ((variance, by_variance), (variance_2, by_variance_2))
        ]
        rows = Rows.of(lambda *of: dprime(*of) ** 2, apart, *spreads)
    else:
        rows = Rows.of(lambda difference: (difference**2).sum(axis=-1), apart)
    far = rows.values > EXACT**2
    return Rows(rows.values * far, rows.by_u * far[:, None])


def _closed_rows(design: SmoothDesign, pairs: Sequence[Pair], factors: PerChannel | float) -> Rows:
    """Return both squared orders of the chromatic distance of each two signals: min |y1 - a y2| and min |a y1 - y2|."""
    members = design.setup.members

    def of(response: Smooth) -> Smooth:
        response, parts = response * factors, []
        for a, b in pairs:
            shape = (*response.shape[:-2], len(members[a]), len(members[b]), response.shape[-1])
            first_signals = np.broadcast_to(response[..., members[a], None, :], shape)
            second_signals = np.broadcast_to(response[..., None, members[b], :], shape)
            area = parallelogram(first_signals, second_signals)
            for vector in (first_signals, second_signals):
                squared = (vector**2).sum(axis=-1)
                ratio = np.divide(area, squared, out=np.zeros_like(area), where=squared.real != 0)
                parts.append(ratio.reshape(*ratio.shape[:-3], -1))
        return np.concatenate(parts, axis=-1)

    return Rows.of(of, design.lamps)
