"""Least noise of any filter, which turns a bound on distances into one on d'.

d'^2 = sum of D^2 / S over the channels, where S, the mean variance of the two signals, grows with the light in the
modified channel. With the least S of any filter of the program, no filter's d' is above

    d'^2 <= sum over the other channels of D^2 / S + D_N^2 / (least S_N),

a distance in units of a noise that does not depend on the filter. The least light of a signal under a least
sensitivity is a fractional knapsack: light is taken where it costs least sensitivity. Its bound is that of the
multiplier y, min l @ N >= y h + sum of min((l - y a) low, (l - y a) high) for a @ N >= h, and holds for any y >= 0.
"""

from __future__ import annotations

import numpy as np

from ..base.types import Array, Float, PerWavelength
from ..camera.linear import LinearModel

_ROUNDING = 1e-12
"""Relative rounding error of the sums over wavelengths."""


def least_variance(
    model: LinearModel, base: PerWavelength, box: tuple[PerWavelength, PerWavelength], row: PerWavelength, least: float
) -> Float[Array, "cases signals"]:
    """Return a lower bound on the variance in the modified channel, DN^2.

    `row`: coefficients of the sensitivity, >= 0; `least`: least sensitivity: row @ N >= least. `base`: curve at which
    the variance is known; it grows with the light.
    """
    pixel, channel = model.pixel, model.setup.camera.modified[0]
    per_qe = model.spread_per_qe(0, base[None])
    at_base = model.spread_electrons(base[None, None])[0, :, :, channel]
    share = model.spread_shares()[:, None, channel]
    constant = at_base - per_qe @ base
    electrons = np.maximum(_least_light(per_qe, box, row, least) + constant, 0.0)
    # The weighted sum of the pixels' squares is no less than the square of their weighted sum over that of the weights.
    variance_e2 = electrons + pixel.prnu**2 * electrons**2 / share + pixel.read_noise_e**2 * share
    return np.asarray((pixel.dn_per_e**2 * variance_e2 + share / 12) * (1 - _ROUNDING), dtype=float)


def _least_light(
    light: Float[Array, "_ _ wavelengths"], box: tuple[PerWavelength, PerWavelength], row: PerWavelength, least: float
) -> Float[Array, "rows columns"]:
    """Return a lower bound on light @ N."""
    low, high = box
    used = row > 0
    ratio = np.divide(light, row, out=np.zeros_like(light), where=used)
    # From high on, take away where most light goes with the sensitivity, down to the least one.
    order = np.argsort(-ratio, axis=-1)
    taken = np.cumsum(np.take_along_axis(np.broadcast_to(row * (high - low), light.shape), order, axis=-1), axis=-1)
    last = np.minimum((taken < row @ high - least).sum(axis=-1, keepdims=True), row.size - 1)
    y = np.maximum(np.take_along_axis(np.take_along_axis(ratio, order, axis=-1), last, axis=-1), 0.0)
    rest = light - y * row
    return np.asarray(y[..., 0] * least + np.minimum(rest * low, rest * high).sum(axis=-1), dtype=float)
