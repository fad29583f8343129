"""What noise may do at the bright end at most, against sums over SciPy's probabilities and the exact moments."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm, poisson

from sweep.camera.noise import moments, tails
from sweep.camera.pixel import Pixel

from ..cases import thinned
from .one_pixel import readout_bound_dn


def gains(prnu: float) -> tuple[np.ndarray, np.ndarray]:
    """Gains of pixels and their weights."""
    if prnu == 0:
        return np.ones(1), np.ones(1)
    z = np.linspace(-9, 9, 721)
    return np.maximum(1 + prnu * z, 0), norm.pdf(z) / norm.pdf(z).sum()


def exact(level: float, electrons: float, prnu: float, read_noise_e: float) -> tuple[float, float]:
    """Share of readouts above a level, and their mean above it."""
    share = mean = 0.0
    for gain, weight in zip(*gains(prnu), strict=True):
        own = electrons * gain
        counts = np.arange(max(0, int(own - 12 * own**0.5) - 20), int(own + 12 * own**0.5) + 60)
        p = poisson.pmf(counts, own) * weight
        if read_noise_e == 0:
            share += float(p @ (counts > level))
            mean += float(p @ np.maximum(counts - level, 0))
        else:
            z = (counts - level) / read_noise_e
            share += float(p @ norm.cdf(z))
            mean += float(p @ (read_noise_e * (z * norm.cdf(z) + norm.pdf(z))))
    return share, mean


@pytest.mark.parametrize("seed", thinned(range(60), 12))
def test_no_tail_is_longer(seed: int) -> None:
    rng = np.random.default_rng(seed)
    electrons = float(10 ** rng.uniform(-1, 4))
    prnu, read_noise_e = float(rng.choice([0, 0.01, 0.1])), float(rng.choice([0, 0.5, 5, 100]))
    deviation = (electrons + (electrons * prnu) ** 2 + read_noise_e**2) ** 0.5
    for far in (-1.0, 0.0, 1.0, 3.0, 6.0):
        level = electrons + far * deviation
        share, mean = exact(level, electrons, prnu, read_noise_e)
        pixel = Pixel(prnu=prnu)
        assert share <= tails.share_above(level, electrons, pixel, read_noise_e) * (1 + 1e-9)
        assert mean <= tails.mean_above(level, electrons, pixel, read_noise_e) * (1 + 1e-9)


@pytest.mark.parametrize("seed", thinned(range(60), 12))
def test_rounding_and_clipping_shift_no_mean_by_more(seed: int) -> None:
    """Over the numbers of electrons up to the brightest; small ranges of the ADC, so that its ends are near."""
    rng = np.random.default_rng(seed)
    bits = int(rng.choice([6, 8, 12]))
    pixel = Pixel(
        bits=bits,
        well_e=float(rng.choice([200.0, 1000.0, 10_000.0])),
        gain_dn_per_e=float(rng.choice([0.1, 0.41, 1.0, 3.0])),
        offset_dn=float(rng.uniform(0, 0.3)) * (2**bits - 1),
        read_noise_e=float(10 ** rng.uniform(-0.5, 1)),
        prnu=float(rng.choice([0, 0.01])),
    )
    brightest_e = float(rng.uniform(0.1, 1.2)) * min(pixel.well_e, pixel.full_scale_dn / pixel.dn_per_e)
    found = moments.moments(np.linspace(0, brightest_e, 400), pixel)
    shift = found[moments.ROUNDED] - found[moments.UNROUNDED]
    assert np.ptp(shift) <= readout_bound_dn("quantization", pixel, brightest_e) + 1e-9
    lost = np.linspace(0, brightest_e, 400) * pixel.dn_per_e + pixel.offset_dn - found[moments.UNROUNDED]
    top_e = min(pixel.well_e, (pixel.full_scale_dn - pixel.offset_dn) / pixel.dn_per_e)
    below = np.linspace(0, brightest_e, 400) <= top_e
    assert np.ptp(lost[below]) <= readout_bound_dn("noise", pixel, brightest_e) + 1e-9


def test_closed_forms_serve_a_usual_sensor() -> None:
    """Two electrons of read noise, a pedestal, and a light that stays a tenth below the full well."""
    pixel = Pixel(read_noise_e=2.0, offset_dn=168.0, prnu=0.01)
    assert 0 < readout_bound_dn("quantization", pixel, 8500.0) < 1e-5
    assert 0 < readout_bound_dn("noise", pixel, 8500.0) < 1e-5
    assert readout_bound_dn("quantization", Pixel(), 100.0) == 1.0
