"""Chromatic distance of two signals: the distance that is left when either lamp may have any brightness.

For responses y1 and y2 to the lamps alone (less black level, dark current and background) it is the smaller of
min |y1 - a y2| and min |a y1 - y2| over a > 0. At an angle t of less than 90 degrees that is min(|y1|, |y2|) sin t,
otherwise min(|y1|, |y2|). The parallelogram |y1|^2 |y2|^2 sin^2 t is summed from the 2 x 2 determinants of the
channels (Lagrange's identity), so that nearly parallel responses lose no digits.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..base.types import FloatArray, IndexArray
from ..camera.linear import linear_model
from ..camera.setup import Setup
from ..spectra.lights import Pair, class_pairs
from .separation import packed_response, pair_blocks
from .smooth import Rows, SmoothDesign
from .tasks.colorimetry import COMPLEX_STEP, Smooth

_LEAST_VARIANCE = 1e-12
"""Smallest variance that counts, DN^2: a channel without noise fixes the relative brightness."""


def parallelogram(first: Smooth, second: Smooth) -> Smooth:
    """Return the squared area of the parallelogram of two vectors.

    Parameters
    ----------
    first, second : ndarray of shape (..., n_channels)
        Vectors; real, or complex with a derivative.

    Returns
    -------
    ndarray of shape (...)
        |first|^2 |second|^2 sin^2 of their angle.
    """
    total = np.zeros(np.broadcast_shapes(first.shape, second.shape)[:-1], dtype=np.result_type(first, second))
    for i in range(first.shape[-1]):
        for j in range(i + 1, first.shape[-1]):
            total += (first[..., i] * second[..., j] - first[..., j] * second[..., i]) ** 2
    return total


def squared_distance(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the squared chromatic distance of two vectors.

    Parameters
    ----------
    first, second : ndarray of shape (..., n_channels)
        Responses less those without lamps.

    Returns
    -------
    ndarray of shape (...)
        Squared distance; 0 for a vector of zeros.
    """
    lengths = [_sum(vector * vector) for vector in (first, second)]
    smaller, larger = np.minimum(*lengths), np.maximum(*lengths)
    area = parallelogram(first, second)
    beyond = _sum(first * second) <= 0
    return np.where(beyond, smaller, np.divide(area, larger, out=np.zeros_like(area), where=larger != 0))


def _sum(values: FloatArray) -> FloatArray:
    """Return the sum over the channels, in their order."""
    total = values[..., 0].copy()
    for channel in range(1, values.shape[-1]):
        total += values[..., channel]
    return total


def chromatic_separation(response: FloatArray, first: IndexArray, second: IndexArray) -> FloatArray:
    """Compute the smallest chromatic distance of two signal types.

    Parameters
    ----------
    response : ndarray of shape (n_designs, n_signals, n_channels)
        Readout less that without lamps, DN.
    first, second : ndarray of int
        Signals of each type.

    Returns
    -------
    ndarray of shape (n_designs,)
        Distance, DN.
    """
    smallest = np.empty(len(response))
    for block, one, other in pair_blocks(response.shape, first, second):
        smallest[block] = squared_distance(response[block][:, one], response[block][:, other]).min(axis=1)
    return np.sqrt(smallest)


def chromatic_separations(response: FloatArray, members: Mapping[str, IndexArray]) -> dict[Pair, FloatArray]:
    """Compute the smallest chromatic distance of every pair of signal types.

    Parameters
    ----------
    response : ndarray of shape (n_designs, n_signals, n_channels)
        Readout less that without lamps, DN.
    members : mapping of str to ndarray of int
        Signals of each type.

    Returns
    -------
    dict of pair to ndarray of shape (n_designs,)
        Distance, DN.
    """
    pairs = class_pairs(list(members))
    packed = packed_response(response, members)
    if packed is None:
        return {(a, b): chromatic_separation(response, members[a], members[b]) for a, b in pairs}
    from .nearest import nearest_chromatic_squared  # noqa: PLC0415  (compiled: kept off the start-up path)

    squared = np.empty((len(response), len(pairs)))
    nearest_chromatic_squared(*packed, squared)
    return dict(zip(pairs, np.sqrt(squared.T), strict=True))


def noise_referred(mean: FloatArray, variance: FloatArray, first: IndexArray, second: IndexArray) -> FloatArray:
    """Compute the smallest chromatic distance in units of the noise.

    As for d', the inner product is the inverse of the mean covariance of both signals (Mahalanobis distance).

    Parameters
    ----------
    mean, variance : ndarray of shape (n_designs, n_signals, n_channels)
        Mean less the response without lamps, DN, and variance, DN^2.
    first, second : ndarray of int
        Signals of each type.

    Returns
    -------
    ndarray of shape (n_designs,)
        Distance.
    """
    smallest = np.empty(len(mean))
    for block, one, other in pair_blocks(mean.shape, first, second):
        deviation = _deviation(variance[block][:, one], variance[block][:, other])
        squared = squared_distance(mean[block][:, one] / deviation, mean[block][:, other] / deviation)
        smallest[block] = squared.min(axis=1)
    return np.sqrt(smallest)


def _deviation(one: Smooth, other: Smooth) -> Smooth:
    """Return the root of the mean variance of two signals."""
    mean = (one + other) / 2
    return np.sqrt(np.where(mean.real > _LEAST_VARIANCE, mean, _LEAST_VARIANCE))


def chromatic_rows(design: SmoothDesign, *, pairs: Sequence[Pair], noise: bool) -> Rows:
    """Return both squared orders of the chromatic distance of each two signals, in every case of the scene.

    The smallest row is the squared distance: min over a of |y1 - a y2| and of |a y1 - y2|, each smooth.

    Parameters
    ----------
    design : SmoothDesign
        Design with derivatives.
    pairs : sequence of pair
        Pairs of signal types.
    noise : bool
        In units of the noise, otherwise in DN.

    Returns
    -------
    Rows
        Values and derivatives.
    """
    members = design.setup.members

    def of(response: Smooth, variance: Smooth | None) -> Smooth:
        parts = []
        for a, b in pairs:
            shape = (*response.shape[:-2], len(members[a]), len(members[b]), response.shape[-1])
            one, other = response[..., members[a], None, :], response[..., None, members[b], :]
            if variance is not None:
                deviation = _deviation(variance[..., members[a], None, :], variance[..., None, members[b], :])
                one, other = one / deviation, other / deviation
            one, other = np.broadcast_to(one, shape), np.broadcast_to(other, shape)
            area = parallelogram(one, other)
            for vector in (one, other):
                squared = (vector**2).sum(axis=-1)
                ratio = np.divide(area, squared, out=np.zeros_like(area), where=squared.real != 0)
                parts.append(ratio.reshape(*ratio.shape[:-3], -1))
        return np.concatenate(parts, axis=-1)

    response, by_u = design.lamps
    if not noise:
        return Rows(of(response, None), of(response + 1j * COMPLEX_STEP * by_u, None).imag.T / COMPLEX_STEP)
    mean, variance, mean_by_u, variance_by_u = design.noisy
    # What saturation takes away from an HDR pixel's mean; else nothing.
    response, by_u = response + (mean - design.response), by_u + (mean_by_u - design.response_by_u)
    along = of(response + 1j * COMPLEX_STEP * by_u, variance + 1j * COMPLEX_STEP * variance_by_u)
    return Rows(of(response, variance), along.imag.T / COMPLEX_STEP)


def smooth_chromatic(setup: Setup, curves: FloatArray, pair: Pair) -> FloatArray:
    """Return the chromatic separation of the smooth response, the smallest over the cases.

    Parameters
    ----------
    setup : Setup
        Scene and camera.
    curves : ndarray of shape (n_designs, n_modified, n_wavelengths)
        QE of the modified channels.
    pair : tuple of str
        Two signal types.

    Returns
    -------
    ndarray of shape (n_designs,)
        Distance, DN.
    """
    model = linear_model(setup)
    response = model.smooth(curves) - model.unlit(curves, model.light.exposure_s(curves))[:, :, None]
    first, second = (setup.members[name] for name in pair)
    over = [chromatic_separation(response[:, case], first, second) for case in range(response.shape[1])]
    return np.asarray(np.min(over, axis=0), dtype=float)
