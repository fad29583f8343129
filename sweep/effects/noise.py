"""Photon, read and dark noise and PRNU: mean and variance of the readout in closed form, and Monte Carlo draws.

The CSD is the distance of mean values. Noise moves a mean only where the readout is not straight: at the full well, at
the ends of the ADC and at the steps of its quantization. Variance where nothing clips (EMVA 1288), before rounding:
gain^2 (read^2 + n + (PRNU n)^2).
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from scipy.special import ndtr

from ..arrays import FloatArray
from ..sensor import Pixel
from ..setup import Setup

METHODS = ("skip", "expected")
_NODES = 48
_TAILS = 9.0
_ROUNDED = 7.0
"""Read noise rounds a corner this many of its standard deviations to either side."""
_MOST_E = 1e100
"""More electrons than this are as many as this."""
_MOST_POISSON_E = 1e18
"""NumPy's Poisson generator takes no larger mean."""


def skip_is_exact(setup: Setup) -> str | None:
    """Why leaving it out changes nothing; None when it may."""
    return None if setup.scenario.noise is not None else "no noise asked for"


def variance_e(electrons: FloatArray, pixel: Pixel) -> FloatArray:
    """Variance of the collected electrons: photon noise and PRNU."""
    electrons = np.minimum(electrons, _MOST_E)
    return np.asarray(electrons + (pixel.prnu * electrons) ** 2, dtype=float)


def least_sigma_dn(pixel: Pixel) -> float:
    """The noise that even a dark pixel has, DN."""
    return pixel.dn_per_e * pixel.read_noise_e


def _density(z: FloatArray) -> FloatArray:
    return np.asarray(np.exp(-0.5 * z**2) / math.sqrt(2 * math.pi), dtype=float)


def _ramp(z: FloatArray) -> FloatArray:
    """Mean of max(0, z + Z)."""
    return np.asarray(z * ndtr(z) + _density(z), dtype=float)


def _clipped(mean: FloatArray, sigma: float, low: float, high: float) -> tuple[FloatArray, FloatArray]:
    """Mean and variance of a Gaussian that is clipped to low..high."""
    if sigma == 0:
        return np.clip(mean, low, high), np.zeros_like(mean)
    # Further outside than the tails, everything is at the end.
    z_low, z_high = (np.clip((end - mean) / sigma, -_TAILS, _TAILS) for end in (low, high))
    shift = _ramp(z_low) - _ramp(-z_high)
    square = np.ones_like(mean)  # E[(clip(z) - 0)^2]: z^2 between the ends, an end's square beyond it
    for z in (z_low, -z_high):
        square += (z**2 - 1) * ndtr(z) + z * _density(z)
    outside = (mean <= low - _TAILS * sigma) | (mean >= high + _TAILS * sigma)
    clipped = np.where(outside, np.clip(mean, low, high), mean + sigma * shift)
    return clipped, np.where(outside, 0.0, sigma**2 * np.maximum(square - shift**2, 0.0))


def moments_dn(electrons: FloatArray, pixel: Pixel) -> tuple[FloatArray, FloatArray]:
    """Mean (DN) and variance (DN^2) before rounding: Gaussian electrons, full well, read noise, pedestal, ADC range.

    Arrays of the shape of `electrons`. Moments are taken around the readout without noise, so that neither a large
    pedestal nor a far excess over the full well costs digits.
    """
    gain, offset, top = pixel.dn_per_e, pixel.offset_dn, float(pixel.full_scale_dn)
    electrons = np.minimum(electrons, _MOST_E)
    sigma = np.sqrt(variance_e(electrons, pixel))
    center = np.clip(gain * np.minimum(electrons, pixel.well_e) + offset, 0.0, top)
    first, second = np.zeros_like(electrons), np.zeros_like(electrons)

    def add(weight: FloatArray, held_e: FloatArray) -> None:
        """Take in what is read from a number of electrons that occurs with this probability."""
        mean, variance = _clipped(gain * held_e + offset, gain * pixel.read_noise_e, 0.0, top)
        first[...] += weight * (mean - center)
        second[...] += weight * (variance + (mean - center) ** 2)

    some = sigma > 0
    full = np.divide(pixel.well_e - electrons, sigma, out=np.full_like(sigma, np.inf), where=some)
    end = np.clip(full, -_TAILS, _TAILS)
    # The ADC's ends are corners that the read noise rounds: integrate between them and over each.
    corners = [np.full_like(end, -_TAILS), end]
    for at_dn in (0.0, top):
        for read_e in (-_ROUNDED * pixel.read_noise_e, _ROUNDED * pixel.read_noise_e):
            at_e = (at_dn - offset) / gain + read_e - electrons
            at = np.divide(at_e, sigma, out=np.full_like(sigma, -_TAILS), where=some)
            corners.append(np.clip(at, -_TAILS, end))
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    for left, right in pairwise(np.sort(corners, axis=0)):
        for node, weight in zip((nodes + 1) / 2, weights / 2, strict=True):
            z = left + node * (right - left)
            add(weight * (right - left) * _density(z), np.minimum(electrons + z * sigma, pixel.well_e))
    add(ndtr(-full), np.full_like(electrons, pixel.well_e))
    return center + first, np.maximum(second - first**2, 0.0)


def draws_dn(electrons: FloatArray, pixel: Pixel, rng: np.random.Generator) -> FloatArray:
    """Monte Carlo: a readout of each pixel, which expects `electrons` and has its own gain error; rounded."""
    gains = 1 + pixel.prnu * rng.standard_normal(electrons.shape)
    held = np.minimum(rng.poisson(np.clip(electrons * gains, 0.0, _MOST_POISSON_E)), pixel.well_e)
    dn = (held + pixel.read_noise_e * rng.standard_normal(electrons.shape)) * pixel.dn_per_e + pixel.offset_dn
    return np.clip(np.floor(dn + 0.5), 0, pixel.full_scale_dn)


def promise(setup: Setup, brightest_e: float) -> float:
    """Range of what leaving noise out changes in one coordinate's mean, DN.

    A clip at distance z sigma, to either side, takes sigma (density(z) - z tail(z)) from the mean. Up to the clip that
    grows with the signal. Beyond it, and at the bottom, it is bounded on intervals of the signal, by the least distance
    and the largest sigma in each.
    """
    pixel = setup.pixel
    gain, offset_e = pixel.dn_per_e, pixel.offset_dn / pixel.dn_per_e

    def taken(distance: FloatArray, sigma: FloatArray) -> FloatArray:
        z = np.maximum(distance, 0.0) / np.maximum(sigma, 1e-300)
        return np.asarray(np.where(sigma > 0, sigma * np.maximum(_density(z) - z * ndtr(-z), 0.0), 0.0))

    def at_the_top(clip_e: float, read_e: float) -> float:
        def spread(electrons: FloatArray) -> FloatArray:
            return np.asarray(np.sqrt(variance_e(electrons, pixel) + read_e**2), dtype=float)

        below = np.array([min(brightest_e, clip_e)])
        found = taken(clip_e - below, spread(below))[0]
        if brightest_e > clip_e:
            unit = spread(np.array([clip_e]))[0] or 1.0
            beyond = clip_e + unit * np.expm1(np.linspace(0, math.log1p((brightest_e - clip_e) / unit), 400))
            found = max(found, taken(beyond[:-1] - clip_e, spread(beyond[1:])).max())
        return float(found)

    top = at_the_top(pixel.well_e, 0.0)
    top += at_the_top((pixel.full_scale_dn - pixel.offset_dn) / gain, pixel.read_noise_e)
    edges = np.concatenate([[0.0], np.geomspace(1e-3, max(brightest_e, 2e-3), 400)])
    sigma = np.sqrt(variance_e(edges[1:], pixel) + pixel.read_noise_e**2)
    bottom = taken(offset_e + edges[:-1], sigma).max()
    return float(gain * (top + bottom))
