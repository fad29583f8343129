"""Errors against sums over every readout of each pixel, of 1 to 48 equal pixels: dim, full, and beside each handover."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

from sweep.camera.noise import errors as sums
from sweep.camera.noise.law import pixel_law
from sweep.camera.noise.merge import merged
from sweep.camera.pixel import Pixel
from sweep.metrics.discrimination import detectability, error_of

from .. import readout_oracle
from ..camera.test_captures import drawn, outcomes, relative_light

ONCE = Pixel(well_e=4000.0, read_noise_e=4.0, offset_dn=60, bits=10)
SPLIT = Pixel(
    captures=[
        {"well_e": 300.0, "read_noise_e": 1.0, "bits": 9},
        {"well_e": 1_200.0, "read_noise_e": 3.0, "bits": 9},
        {"sensitivity": 0.1, "well_e": 900.0, "read_noise_e": 1.0, "bits": 9},
    ],
    offset_dn=20,
    threshold=0.9,
)
REGIMES = {
    "dim": (ONCE, 12.0, 1),
    "full": (ONCE, 3980.0, -1),
    "first": (SPLIT, 265.0, 1),
    "second": (SPLIT, 1055.0, 1),
    "beyond": (SPLIT, 1090.0, -1),
}
"""Pixel, electrons of a signal, and whether the other is brighter: of few photons, beside the full well and handovers."""
PIXELS = (1, 4, 16, 48)
WANTED = (1e-2, 1e-4, 1e-6, 1e-9, 1e-12)
_STEPS = 24
"""Steps of the grid of values in the smaller deviation of both signals' means."""
DRAWS = 40_000
ONE, OTHER = np.array([0]), np.array([1])


def moments(electrons: float, pixel: Pixel) -> tuple[float, float]:
    if pixel.captures:
        light = relative_light(pixel)[:, None]
        found = merged(light * electrons, light, pixel)
        return float(found.mean[0]), float(found.variance[0])
    mean, variance = pixel_law(pixel).at(0, np.array([electrons]), 2)[:, 0]
    return float(mean), float(variance)


def gaussian_error(first: float, second: float, pixel: Pixel, n: int) -> float:
    """Q(r) of the mean of n equal pixels."""
    mean, spread = np.array([moments(e, pixel) for e in (first, second)]).T
    return float(error_of(detectability(mean[None, :, None], spread[None, :, None] / n, ONE, OTHER))[0])


@cache
def other_of(regime: str, n: int, wanted: float) -> float:
    """Electrons of the other signal, of which Q(r) is the wanted error."""
    pixel, electrons, sign = REGIMES[regime]
    near, far = electrons, electrons * 30.0**sign
    for _ in range(50):
        middle = (near + far) / 2
        near, far = (middle, far) if gaussian_error(electrons, middle, pixel, n) > wanted else (near, middle)
    return near


def of_pixel(electrons: float, pixel: Pixel) -> tuple[np.ndarray, np.ndarray]:
    """Values of a pixel, DN, and how often they occur."""
    if not pixel.captures:
        numbers, often = readout_oracle.digital_numbers(electrons, pixel)
        return numbers.astype(float), often
    found = outcomes(relative_light(pixel) * electrons, pixel)
    return np.array([*found]) * pixel.dn_per_e + pixel.offset_dn, np.array([*found.values()])


def summed(values: np.ndarray, often: np.ndarray, step: float, n: int) -> tuple[int, np.ndarray]:
    """First place and how often each occurs, of the sum of n pixels on a grid, each value shared by its neighbors."""
    place = values / step
    low = np.floor(place + 1e-9).astype(int)
    first, share = int(low.min()), np.clip(place - low, 0, 1)
    one = np.bincount(low - first, often * (1 - share), low.max() - first + 2)
    one += np.bincount(low - first + 1, often * share, one.size)
    total, begin = np.ones(1), 0
    for bit in f"{n:b}":
        total, begin = np.convolve(total, total), 2 * begin
        if bit == "1":
            total, begin = np.convolve(total, one), begin + first
        kept = np.flatnonzero(total > 1e-30)
        total, begin = total[kept[0] : kept[-1] + 1], begin + int(kept[0])
    return begin, total


def exact_error(first: float, second: float, pixel: Pixel, n: int) -> float:
    """Half the sum of the lesser of both probabilities, over all sums of n pixels."""
    both = [of_pixel(e, pixel) for e in (first, second)]
    deviation = min(math.sqrt(max(often @ values**2 - (often @ values) ** 2, 0.0)) for values, often in both)
    step = 1.0 if not pixel.captures else max(deviation * math.sqrt(n) / _STEPS, 1e-3)
    (low_a, p), (low_b, q) = (summed(*of, step, n) for of in both)
    low, size = min(low_a, low_b), max(low_a + p.size, low_b + q.size) - min(low_a, low_b)
    whole = np.zeros((2, size))
    whole[0, low_a - low : low_a - low + p.size] = p
    whole[1, low_b - low : low_b - low + q.size] = q
    return float(whole.min(axis=0).sum() / 2)


def stated(first: float, second: float, pixel: Pixel, n: int) -> float:
    """The error of few pixels as a study states it."""
    light = relative_light(pixel) if pixel.captures else None
    electrons = np.repeat(np.array([[[first], [second]]]), n, axis=2)
    if light is not None:
        electrons = light[:, None, None, None] * electrons
    of_pixels = None if light is None else np.repeat(light[:, None], n, axis=1)
    return float(sums.errors(electrons, [np.arange(n)], pixel, {"a": ONE, "b": OTHER}, of_pixels)["a", "b"][0])


def draws(electrons: float, pixel: Pixel, n: int, rng: np.random.Generator) -> np.ndarray:
    """Sums of n pixels, drawn by chance."""
    count = DRAWS * n
    if pixel.captures:
        values = drawn(relative_light(pixel) * electrons, pixel, rng, count)
    else:
        held = np.minimum(rng.poisson(electrons, count), pixel.well_e) + pixel.read_noise_e * rng.standard_normal(count)
        values = np.clip(np.floor(held * pixel.dn_per_e + pixel.offset_dn + 0.5), 0, pixel.full_scale_dn)
    return values.reshape(n, DRAWS).sum(axis=0)


@pytest.mark.parametrize("regime", REGIMES)
@pytest.mark.parametrize(
    "n", [1, pytest.param(4, marks=pytest.mark.slow), pytest.param(16, marks=pytest.mark.slow), 48]
)
def test_errors_are_those_of_sums_over_all_readouts(regime: str, n: int) -> None:
    """Of up to 16 pixels as a study sums them, of merged captures up to 4, of more Q(r). Bins of an eighth of the noise of
    merged captures tell the signals apart less well; beside a full well no plane is as good as the best rule.
    """
    pixel, electrons, _ = REGIMES[regime]
    for wanted in WANTED:
        other = other_of(regime, n, wanted)
        exact = exact_error(electrons, other, pixel, n)
        if n > (4 if pixel.captures else 16):
            assert exact <= wanted if regime == "full" else exact**1.1 <= wanted <= 1.1 * exact**0.9, (wanted, exact)
        elif pixel.captures:
            assert 0.98 * exact <= stated(electrons, other, pixel, n) <= max(2 * exact, exact**0.9), (wanted, exact)
        else:
            assert stated(electrons, other, pixel, n) == pytest.approx(exact, rel=0.065), (wanted, exact)


@pytest.mark.slow
@pytest.mark.parametrize("regime", REGIMES)
@pytest.mark.parametrize("n", [1, 48])
def test_sums_over_all_readouts_are_those_of_draws(regime: str, n: int) -> None:
    pixel, electrons, _ = REGIMES[regime]
    other, rng = other_of(regime, n, 0.01), np.random.default_rng(n)
    ours, theirs = (np.sort(draws(e, pixel, n, rng)) for e in (electrons, other))
    ours, theirs = (ours, theirs) if ours.mean() < theirs.mean() else (theirs, ours)
    cuts = np.unique(np.concatenate([ours, theirs]))
    errors = 1 - np.searchsorted(ours, cuts, "right") / DRAWS + np.searchsorted(theirs, cuts, "right") / DRAWS
    least, exact = errors.min() / 2, exact_error(electrons, other, pixel, n)
    assert least >= exact - 4 * math.sqrt(exact / DRAWS)
    if regime in ("dim", "first"):  # elsewhere two cuts err less than one
        assert least <= exact + 4 * math.sqrt(exact / DRAWS)
