"""Mean and variance of a clipped and of a rounded Gaussian, in closed form."""

from __future__ import annotations

import math

import numpy as np

from ...base.types import Array, Float, PerValue, SameShape

TAILS = 9.0
"""Beyond so many standard deviations everything is taken to be at the end."""
SMOOTH_DN = 1.5
"""From here on noise hides the steps of rounding: their series begins with exp(-2 (pi 1.5)^2) < 1e-19."""
_SERIES_DN = 0.5
_TERMS = 6
_EULER_DN = 4.0


def density(z: SameShape) -> SameShape:
    """Return the density of the standard normal distribution."""
    return np.asarray(np.exp(-0.5 * z**2) / math.sqrt(2 * math.pi), dtype=float)


def share_below(z: Float[Array, " *batch"] | float) -> Float[Array, " ..."]:
    """Return the standard normal distribution function.

    Returns probability below z.
    """
    from scipy.special import ndtr  # noqa: PLC0415  (slow to import: kept off the start-up path)

    return np.asarray(ndtr(z), dtype=float)


def ramp(z: SameShape) -> SameShape:
    """Return the mean of max(0, z + Z) for a standard normal Z."""
    return np.asarray(z * share_below(z) + density(z), dtype=float)


def clipped_gaussian(mean: PerValue, sigma: float, low: float, high: float) -> tuple[PerValue, PerValue]:
    """Return mean and variance of a clipped Gaussian."""
    if sigma == 0:
        return np.clip(mean, low, high), np.zeros_like(mean)
    z_low, z_high = (np.clip((end - mean) / sigma, -TAILS, TAILS) for end in (low, high))
    shift = ramp(z_low) - ramp(-z_high)
    square = np.ones_like(mean)  # E[(clip(z) - 0)^2]: z^2 between the ends, an end's square beyond it
    for z in (z_low, -z_high):
        square += (z**2 - 1) * share_below(z) + z * density(z)
    outside = (mean <= low - TAILS * sigma) | (mean >= high + TAILS * sigma)
    held = np.where(outside, np.clip(mean, low, high), mean + sigma * shift)
    return held, np.where(outside, 0.0, sigma**2 * np.maximum(square - shift**2, 0.0))


def clipped_and_rounded(mean: PerValue, sigma: float, top: float) -> tuple[PerValue, PerValue]:
    """Return mean and variance of round(clip(x, 0, top)) for Gaussian x, DN and DN^2.

    The sum over the steps of the probability of passing each, or, where the noise spans many steps, the Euler-
    Maclaurin series of the midpoint rule for that sum (four terms: less than 1e-10 DN is left from 4 DN of noise on).

    `mean`: means before clipping, DN; `sigma`: standard deviation, DN; `top`: full scale, an integer, DN.
    """
    if sigma == 0:
        return np.clip(np.floor(mean + 0.5), 0.0, top), np.zeros_like(mean)
    if sigma < _EULER_DN:
        from .kernels import rounded_gaussian  # noqa: PLC0415  (compiled: kept off the start-up path)

        out = np.empty((2, mean.size))
        rounded_gaussian(np.ascontiguousarray(mean), sigma, top, out)
        return out[0], out[1]
    held, variance = clipped_gaussian(mean, sigma, 0.0, top)
    first, second = np.zeros_like(mean), np.zeros_like(mean)
    for end, sign in ((0.0, 1.0), (top, -1.0)):
        z = (end - mean) / sigma
        # Derivatives of f(t) = P(x > t): f^(k) = -(-1)^(k-1) He_(k-1)(z) density(z) / sigma^k.
        hermite = [np.ones_like(z), z]
        for k in range(1, 8):
            hermite.append(z * hermite[k] - k * hermite[k - 1])
        f = [share_below(-z), *((-1) ** k * hermite[k - 1] * density(z) / sigma**k for k in range(1, 8))]
        for order, weight in ((1, 1 / 24), (3, -7 / 5760), (5, 31 / 967680), (7, -127 / 154828800)):
            first += sign * weight * f[order]
            second += sign * weight * (2 * order * f[order - 1] + 2 * (end - held) * f[order])
    return held + first, np.maximum(variance + second - first**2, 0.0)


def _by_series(rest: PerValue, sigma: PerValue) -> tuple[PerValue, PerValue]:
    """Return mean of e = round(x) - x and variance of round(x), by the Fourier series of e in the mean of x.

    E[e] = sum over k of (-1)^k sin(2 pi k m) exp(-2 (pi k sigma)^2) / (pi k). Variance: sigma^2 + E[e^2] - E[e]^2 + 2
    cov(x, e); Stein's lemma gives the covariance.
    """
    shift, square, slope = np.zeros_like(rest), np.full_like(rest, 1 / 12), np.zeros_like(rest)
    for k in range(1, _TERMS + 1):
        decay = (-1) ** k * np.exp(-2 * (math.pi * k * sigma) ** 2)
        cosine = np.cos(2 * math.pi * k * rest) * decay
        shift += np.sin(2 * math.pi * k * rest) * decay / (math.pi * k)
        square += cosine / (math.pi * k) ** 2
        slope += 2 * cosine
    return shift, sigma**2 * (1 + 2 * slope) + square - shift**2


def _by_steps(rest: PerValue, sigma: PerValue) -> tuple[PerValue, PerValue]:
    """Return the same from the probabilities of passing each step, for little noise."""
    mean, square = np.zeros_like(rest), np.zeros_like(rest)
    least = np.maximum(sigma, 1e-12)
    for step in range(_TERMS):
        up, down = share_below((rest - step - 0.5) / least), share_below((-rest - step - 0.5) / least)
        mean += up - down
        square += (2 * step + 1) * (up + down)
    return mean - rest, np.maximum(square - mean**2, 0.0)


def rounding(mean_dn: PerValue, sigma_dn: PerValue) -> tuple[PerValue, PerValue]:
    """Return mean of round(x) - x, DN, and variance of round(x), DN^2, for Gaussian x far from both ends of the ADC."""
    rest = mean_dn - np.floor(mean_dn + 0.5)
    shift, variance = np.zeros_like(rest), sigma_dn**2 + 1 / 12
    little = sigma_dn < _SERIES_DN
    for where, moments in ((little, _by_steps), (~little & (sigma_dn < SMOOTH_DN), _by_series)):
        if where.any():
            shift[where], variance[where] = moments(rest[where], sigma_dn[where])
    return shift, variance
