"""Merged value of an HDR pixel: mean and variance from the moments of its captures.

A capture k of relative light a_k (sensitivity times exposure ratio) reads x_k electrons; x_k / a_k is an estimate of
the electrons of a pixel of full sensitivity. Captures at or beyond their threshold are left out; the last one never
is. The merged value is the weighted sum of the estimates:

`saturated` : the first capture that is usable (ISETCam's rule for split pixels).
`weighted` : generalized least squares, with the variances at the expected light: (n + r^2 + q^2 / 12) / a^2 for n
    expected electrons, read noise r and steps of q electrons; captures of an exposure share their photon noise.

Gains of pixels (PRNU) are common to all captures of a pixel.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...base.types import Array, Float, FloatArray, PerCapture, SameShape
from ..pixel import Pixel, unquantized
from .moments import DRAWN, LinearRange
from .rounding import rounded
from .subsets import Subset, SubsetMoments, subset_table, threshold_dn

_PER_DEVIATION = 1.3
_CERTAIN_DN2, _ROUNDING = 1e-9, 1e-15
_HELD = 200_000
"""Values of pixels, of several gains, that are held at once."""


@dataclass(frozen=True)
class Merged:
    """Merged values.

    `mean`, `variance`: mean, DN of the first capture, and variance, DN^2.
    """

    mean: SameShape
    variance: Float[Array, "*#batch"]


def limits_dn(pixel: Pixel) -> tuple[int | None, ...]:
    """Return the digital number from which on each capture is not used; None for the last one."""
    return (*(threshold_dn(capture, pixel.threshold) for capture in pixel.read_as[:-1]), None)


def exposure_of(pixel: Pixel) -> list[int]:
    """Return the index of the exposure of each capture."""
    of = {number: at for at, exposure in enumerate(pixel.exposures) for number in exposure.numbers}
    return [of[number] for number in range(len(pixel.captures))]


def light_of(pixel: Pixel) -> Float[Array, " captures"]:
    """Return the light of each exposure relative to that of a pixel of full sensitivity.

    `pixel`: HDR pixel, whose captures have its QE and crosstalk.
    """
    return np.array([exposure.capture.light for exposure in pixel.exposures])


def saturating_e(pixel: Pixel) -> Float[Array, " captures"]:
    """Return the expected electrons of each exposure from which on all its captures are saturated."""
    last_e = np.array([LinearRange.of(capture).last_e for capture in pixel.read_as])
    return np.array([last_e[list(exposure.numbers)].max() for exposure in pixel.exposures])


def merged(electrons: PerCapture, light: PerCapture, pixel: Pixel) -> Merged:
    """Merge noisy captures.

    `electrons`: expected electrons of each of `Pixel.exposures`; `light`: light of each exposure relative to that of a
    pixel of full sensitivity.
    """
    result = _over_gains(electrons, light, pixel) if pixel.prnu else _merged(electrons, light, pixel)
    mean, variance = result.mean, result.variance
    if pixel.companding:
        variance = variance + _step_dn(mean, pixel) ** 2 / 12  # as if noise dithers the steps
    # One reading in all but a billionth of the readouts: what is left is rounding of the arithmetic, by which two
    # signals would seem separated with certainty. Two readings of a capture are at least 1 DN apart.
    constant = variance < np.maximum(_CERTAIN_DN2, _ROUNDING * mean**2)
    return Merged(np.where(constant, np.round(mean, 6), mean), np.where(constant, 0.0, variance))


def _step_dn(dn: SameShape, pixel: Pixel) -> SameShape:
    """Return the step of a code at merged values, DN."""
    knees_dn, codes = pixel.knees
    at = np.clip(np.searchsorted(knees_dn, dn, side="right") - 1, 0, codes.size - 2)
    return np.asarray((np.diff(knees_dn) / np.diff(codes))[at], dtype=float)


def coded(dn: SameShape, pixel: Pixel) -> SameShape:
    """Store merged values as codes, and read them back.

    `dn`: merged values, DN of the first capture; `pixel`: HDR pixel; without companding the values stay. Returns values
    of the codes, DN of the first capture.
    """
    if not pixel.companding:
        return dn
    knees_dn, codes = pixel.knees
    return np.asarray(np.interp(np.floor(np.interp(dn, knees_dn, codes) + 0.5), codes, knees_dn), dtype=float)


def _over_gains(electrons: PerCapture, light: PerCapture, pixel: Pixel) -> Merged:
    """Return the mean over Gaussian gains of the pixels, by the trapezoidal rule."""
    steps = math.ceil(DRAWN * _PER_DEVIATION * math.sqrt(1 + pixel.prnu**2 * max(saturating_e(pixel))))
    z = DRAWN * np.arange(-steps, steps + 1) / steps
    weights = np.exp(-0.5 * z**2) / np.exp(-0.5 * z**2).sum()
    mean = square = spread = np.zeros(electrons.shape[1:])
    about = _merged(electrons, light, pixel)
    at_once = max(1, _HELD // max(1, electrons.size))
    for start in range(0, z.size, at_once):
        part = slice(start, start + at_once)
        gains = (1 + pixel.prnu * z[part]).reshape(-1, *(1,) * (electrons.ndim - 1))
        block = _merged(electrons[:, None] * gains, light[:, None], pixel)
        for weight, value, variance in zip(weights[part], block.mean - about.mean, block.variance, strict=True):
            mean, square, spread = mean + weight * value, square + weight * value**2, spread + weight * variance
    return Merged(about.mean + mean, spread + square - mean**2)


def _merged(electrons: PerCapture, light: PerCapture, pixel: Pixel) -> Merged:
    limits, moments = limits_dn(pixel), []
    for exposure, expected in zip(pixel.exposures, electrons, strict=True):
        captures = tuple(pixel.read_as[number] for number in exposure.numbers)
        table = subset_table(captures, tuple(limits[number] for number in exposure.numbers))
        moments.append(table.at(expected))
    total, offset = np.zeros(electrons.shape[1:]), pixel.offset_dn
    parts = []
    for usable in itertools.product(*moments):
        conditional = [of[subset] for of, subset in zip(moments, usable, strict=True)]
        share = np.prod([subset_moments.share for subset_moments in conditional], axis=0)
        if not any(usable) or not share.any():
            continue
        parts.append((share, *_combined(conditional, weights_of(usable, electrons, light, pixel), light)))
    for share, mean, _ in parts:
        total = total + share * mean
    variance = sum(share * (spread + (mean - total) ** 2) for share, mean, spread in parts)
    gain = pixel.dn_per_e
    return Merged(gain * total + offset, np.asarray(gain**2 * variance, dtype=float))


def _combined(
    moments: list[SubsetMoments], weights: Mapping[tuple[int, int], SameShape], light: PerCapture
) -> tuple[SameShape, SameShape]:
    """Return mean and variance of the weighted sum, in electrons of a pixel of full sensitivity."""
    mean = variance = np.zeros(moments[0].share.shape)
    for (at, number), weight in weights.items():
        share = weight / light[at]
        mean = mean + share * moments[at].mean_e[number]
        for (other_at, other), other_weight in weights.items():
            if other_at == at:
                variance = variance + share * other_weight / light[at] * moments[at].covariance_e2[number, other]
    return mean, variance


def weights_of(
    usable: tuple[Subset, ...], electrons: Float[Array, " captures *batch"], light: PerCapture, pixel: Pixel
) -> dict[tuple[int, int], SameShape]:
    """Return the weight of each usable capture.

    Returns exposure and place in it -> weight. Their sum is 1.
    """
    places = [(at, number) for at, numbers in enumerate(usable) for number in numbers]
    order = {place: pixel.exposures[place[0]].numbers[place[1]] for place in places}
    if pixel.merge == "saturated":
        return {min(places, key=lambda place: order[place]): np.ones(electrons.shape[1:])}
    of_light, in_exposure = dict[int, FloatArray](), dict[tuple[int, int], float]()
    for at, numbers in enumerate(usable):
        if numbers:
            noise_e2 = {number: _read_noise_e2(pixel.read_as[order[at, number]]) for number in numbers}
            together = 1 / sum(1 / noise for noise in noise_e2.values())
            in_exposure |= {(at, number): together / noise for number, noise in noise_e2.items()}
            of_light[at] = light[at] ** 2 / (electrons[at] + together)
    total = sum(of_light.values())
    return {place: share * of_light[place[0]] / total for place, share in in_exposure.items()}


def _read_noise_e2(pixel: Pixel) -> float:
    return float(pixel.read_noise_e**2 + 1 / (12 * pixel.dn_per_e**2))


def without_noise(
    electrons: Float[Array, " captures *batch"], light: PerCapture, pixel: Pixel, *, rounds: bool = True
) -> SameShape:
    """Merge captures that are clipped and rounded, without noise.

    Returns merged values, DN of the first capture.
    """
    read = []
    for at, capture in zip(exposure_of(pixel), pixel.read_as, strict=True):
        held = np.minimum(electrons[at], capture.saturation_e)
        read.append(rounded(held * capture.dn_per_e, capture) if rounds else unquantized(held, capture))
    values = merged_readings(read, electrons, light, pixel)
    return coded(values, pixel) if rounds else values


def merged_readings(
    read_dn: Sequence[SameShape], electrons: Float[Array, " captures *batch"], light: PerCapture, pixel: Pixel
) -> SameShape:
    """Merge what captures read.

    `electrons`: expected electrons, which weights of `merge: weighted` depend on. Returns merged values, DN of the
    first capture.
    """
    limits, result = limits_dn(pixel), np.zeros(electrons.shape[1:])
    everywhere = np.ones(result.shape, dtype=bool)
    below = [everywhere if limit is None else dn < limit for dn, limit in zip(read_dn, limits, strict=True)]
    for usable in _subsets(pixel):
        chosen = {pixel.exposures[at].numbers[place] for at, places in enumerate(usable) for place in places}
        here = np.all([below[k] == (k in chosen) for k in range(len(below))], axis=0)
        if not here.any():
            continue
        for (at, place), weight in weights_of(usable, electrons, light, pixel).items():
            number = pixel.exposures[at].numbers[place]
            estimate = (read_dn[number] - pixel.offset_dn) / (pixel.read_as[number].dn_per_e * light[at])
            result += here * weight * estimate
    return np.asarray(pixel.dn_per_e * result + pixel.offset_dn, dtype=float)


def _subsets(pixel: Pixel) -> Iterator[tuple[Subset, ...]]:
    """Yield usable captures of each exposure; the last capture always is."""
    last = len(pixel.captures) - 1
    of_exposure = []
    for exposure in pixel.exposures:
        places = range(len(exposure.numbers))
        subsets = [s for size in range(len(places) + 1) for s in itertools.combinations(places, size)]
        of_exposure.append([s for s in subsets if last not in exposure.numbers or exposure.numbers.index(last) in s])
    return itertools.product(*of_exposure)
