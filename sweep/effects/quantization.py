"""Rounding to digital numbers; under noise, its mean effect."""

from __future__ import annotations

import math

import numpy as np
from scipy.special import ndtr

from ..arrays import FloatArray
from ..sensor import Pixel
from ..setup import Setup
from .noise import least_sigma_dn, variance_e

METHODS = ("skip", "round")
_TERMS = 6
_STEPS = 6
_LITTLE_DN = 0.5
_MUCH_DN = 1.5
"""From here on the first term of the series, exp(-2 (pi 1.5)^2), is below the rounding of a float."""
_LEAST_SIGMA_DN = 1e-12


def skip_is_exact(_: Setup) -> str | None:
    """Rounding always changes something."""
    return None


def rounded(dn: FloatArray, pixel: Pixel) -> FloatArray:
    """The pedestal added to `dn`, rounded half up, inside the ADC's range.

    The whole part of the pedestal is added after rounding, so that no digit of a float is lost to it: values with and
    without a whole pedestal differ by exactly that.
    """
    whole = math.floor(pixel.offset_dn)
    steps = np.floor(dn + (pixel.offset_dn - whole) + 0.5) + whole
    return np.asarray(np.clip(steps, 0, pixel.full_scale_dn), dtype=float)


def _by_series(rest: FloatArray, sigma: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean of e = round(x) - x, and variance of round(x), by the Fourier series of e in the mean of x.

    E[e] = sum over k of (-1)^k sin(2 pi k m) exp(-2 (pi k sigma)^2) / (pi k). Variance: sigma^2 + E[e^2] - E[e]^2 +
    2 cov(x, e); Stein's lemma gives the covariance.
    """
    shift, square, slope = np.zeros_like(rest), np.full_like(rest, 1 / 12), np.zeros_like(rest)
    for k in range(1, _TERMS + 1):
        decay = (-1) ** k * np.exp(-2 * (math.pi * k * sigma) ** 2)
        cosine = np.cos(2 * math.pi * k * rest) * decay
        shift += np.sin(2 * math.pi * k * rest) * decay / (math.pi * k)
        square += cosine / (math.pi * k) ** 2
        slope += 2 * cosine
    return shift, sigma**2 * (1 + 2 * slope) + square - shift**2


def _by_steps(rest: FloatArray, sigma: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The same from the probabilities to pass each step, where little noise lets the series converge slowly."""
    mean, square = np.zeros_like(rest), np.zeros_like(rest)
    least = np.maximum(sigma, _LEAST_SIGMA_DN)
    for step in range(_STEPS):
        up, down = ndtr((rest - step - 0.5) / least), ndtr((-rest - step - 0.5) / least)
        mean += up - down
        square += (2 * step + 1) * (up + down)
    return mean - rest, np.maximum(square - mean**2, 0.0)


def rounding(mean_dn: FloatArray, sigma_dn: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean of round(x) - x (DN) and variance of round(x) (DN^2) for Gaussian x."""
    rest = mean_dn - np.floor(mean_dn + 0.5)
    shift, variance = np.zeros_like(rest), sigma_dn**2 + 1 / 12
    little = sigma_dn < _LITTLE_DN
    for where, moments in ((little, _by_steps), (~little & (sigma_dn < _MUCH_DN), _by_series)):
        if where.any():
            shift[where], variance[where] = moments(rest[where], sigma_dn[where])
    return shift, variance


def dithered(dn: FloatArray, electrons: FloatArray, pixel: Pixel) -> FloatArray:
    """Mean of the rounded value where noise of the pixel dithers it."""
    sigma = pixel.dn_per_e * np.sqrt(variance_e(electrons, pixel) + pixel.read_noise_e**2)
    return np.asarray(dn + rounding(dn, sigma)[0], dtype=float)


def variance_of_rounded(mean_dn: FloatArray, variance_dn: FloatArray) -> FloatArray:
    """Variance of round(x), DN^2, for Gaussian x of this mean and variance."""
    return rounding(mean_dn, np.sqrt(variance_dn))[1]


def promise(setup: Setup) -> float:
    """Range of what leaving it out changes in one coordinate, DN: 1, or under noise twice the series' largest sum."""
    if setup.scenario.noise is None:
        return 1.0
    sigma = least_sigma_dn(setup.pixel)
    return min(1.0, 2 * sum(math.exp(-2 * (math.pi * k * sigma) ** 2) / (math.pi * k) for k in range(1, 50)))


def steepness(setup: Setup) -> float:
    """Largest slope of the mean rounded value under noise."""
    sigma = least_sigma_dn(setup.pixel)
    return 1 + 2 * sum(math.exp(-2 * (math.pi * k * sigma) ** 2) for k in range(1, _TERMS + 1))
