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


def skip_is_exact(_: Setup) -> str | None:
    """Rounding always changes something."""
    return None


def rounded(dn: FloatArray, pixel: Pixel) -> FloatArray:
    """Rounded half up, inside the ADC's range."""
    return np.clip(np.floor(dn + 0.5), 0, pixel.full_scale_dn)


def mean_step(dn: FloatArray, sigma_dn: FloatArray) -> FloatArray:
    """Mean of round(x + noise) - x for Gaussian noise.

    sum over k of (-1)^k sin(2 pi k x) exp(-2 (pi k sigma)^2) / (pi k); where little noise lets that converge slowly,
    the sum over the steps of the probability to pass each.
    """
    found = np.zeros_like(dn)
    for k in range(1, _TERMS + 1):
        found += (-1) ** k / (math.pi * k) * np.sin(2 * math.pi * k * dn) * np.exp(-2 * (math.pi * k * sigma_dn) ** 2)
    rest = dn - np.floor(dn + 0.5)
    sigma = np.maximum(sigma_dn, 1e-12)
    passed = -rest
    for step in range(_STEPS):
        passed = passed + ndtr((rest - step - 0.5) / sigma) - ndtr((-rest - step - 0.5) / sigma)
    return np.where(sigma_dn < _LITTLE_DN, passed, found)


def dithered(dn: FloatArray, electrons: FloatArray, pixel: Pixel) -> FloatArray:
    """Mean of the rounded value where noise of the pixel dithers it."""
    sigma = pixel.dn_per_e * np.sqrt(variance_e(electrons, pixel) + pixel.read_noise_e**2)
    return np.asarray(dn + mean_step(dn, sigma), dtype=float)


def promise(setup: Setup) -> float:
    """Range of what leaving it out changes in one coordinate, DN: 1, or under noise twice the series' largest sum."""
    if not setup.scenario.noise:
        return 1.0
    sigma = least_sigma_dn(setup.pixel)
    return min(1.0, 2 * sum(math.exp(-2 * (math.pi * k * sigma) ** 2) / (math.pi * k) for k in range(1, 50)))


def steepness(setup: Setup) -> float:
    """Largest slope of the mean rounded value under noise."""
    sigma = least_sigma_dn(setup.pixel)
    return 1 + 2 * sum(math.exp(-2 * (math.pi * k * sigma) ** 2) for k in range(1, _TERMS + 1))
