"""What pedestal and full well change, against a pixel that is read one exact number at a time."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from scipy.special import ndtr
from scipy.stats import norm, poisson

from sweep.camera.effects import pedestal, saturation
from sweep.camera.imager import Imager
from sweep.camera.methods import Methods
from sweep.camera.pixel import Pixel

from ..cases import thinned
from ..hard.scenes import scene

PIXELS = {
    "whole": {"offset_dn": 168.0},
    "half": {"offset_dn": 168.5},
    "a fraction": {"offset_dn": 3.3},
    "below one": {"offset_dn": 0.2},
    "near the end": {"offset_dn": 250.6, "bits": 8},
    "all of the range": {"offset_dn": 254.5, "bits": 8},
    "well first": {"offset_dn": 10.5, "well_e": 500.0, "gain_dn_per_e": 0.4, "bits": 8},
    "well first, whole": {"offset_dn": 10.0, "well_e": 499.0, "gain_dn_per_e": 0.3, "bits": 8},
    "ADC first": {"offset_dn": 20.0, "well_e": 2000.0, "gain_dn_per_e": 0.37, "bits": 8},
    "24 bits": {"offset_dn": 1e6, "bits": 24},
}


def value(electrons: Fraction, pixel: Pixel, offset: float, methods: Methods) -> Fraction:
    """One pixel without noise, in exact arithmetic."""
    if methods.saturation == "clip":
        electrons = min(electrons, Fraction(pixel.well_e))
    dn = electrons * Fraction(pixel.dn_per_e) + Fraction(offset)
    if methods.saturation == "clip" or methods.quantization == "round":
        dn = min(dn, Fraction(pixel.full_scale_dn))
    return Fraction(math.floor(dn + Fraction(1, 2))) if methods.quantization == "round" else dn


def electrons_up_to(brightest_dn: float, pixel: Pixel, offset: float) -> list[Fraction]:
    """An even grid, and numbers on both sides of the steps near both ends and in the middle."""
    most = Fraction(brightest_dn) / Fraction(pixel.dn_per_e)
    grid = [most * i / 200 for i in range(201)]
    for end in (0.0, brightest_dn / 2, brightest_dn, pixel.well_e * pixel.dn_per_e, pixel.full_scale_dn - offset):
        for step in range(-2, 3):
            for shift in (0.0, offset):
                at = (Fraction(math.floor(end + shift) + step) + Fraction(1, 2) - Fraction(shift)) / Fraction(
                    pixel.dn_per_e
                )
                grid += [at - Fraction(1, 10**6), at, at + Fraction(1, 10**6)]
    return [e for e in grid if 0 <= e <= most]


@pytest.mark.parametrize("name", list(PIXELS))
@pytest.mark.parametrize("quantization", ["skip", "round"])
@pytest.mark.parametrize("clip", ["skip", "clip"])
@pytest.mark.parametrize("share", thinned([0.9, 0.3, 1.05, 1.4], 4))
def test_the_pedestal_without_noise(name: str, quantization: str, clip: str, share: float) -> None:
    made = scene("one", "RGGB", {}, PIXELS[name])
    pixel, methods = made.view.pixel, Methods(quantization=quantization, saturation=clip)
    brightest_dn = share * pixel.full_scale_dn
    offset = pixel.offset_dn
    changes = [
        value(e, pixel, offset, methods) - value(e, pixel, 0.0, methods)
        for e in electrons_up_to(brightest_dn, pixel, offset)
    ]
    realized = float(max(changes) - min(changes))
    promised = pedestal.Pedestal().range_dn(made.view, brightest_dn, methods)
    assert realized <= promised + 1e-9
    assert promised <= realized + (1.0 if quantization == "round" else 1e-9)
    if offset == math.floor(offset) and brightest_dn + offset < pixel.full_scale_dn - 1:
        assert promised == 0


@pytest.mark.parametrize("name", list(PIXELS))
@pytest.mark.parametrize("quantization", ["skip", "round"])
@pytest.mark.parametrize("share", thinned([1.4, 0.3, 0.9, 1.05], 4))
def test_the_full_well_without_noise(name: str, quantization: str, share: float) -> None:
    made = scene("one", "RGGB", {}, PIXELS[name])
    pixel = made.view.pixel
    brightest_dn = share * pixel.full_scale_dn
    changes = [
        value(e, pixel, pixel.offset_dn, Methods(quantization=quantization, saturation="skip"))
        - value(e, pixel, pixel.offset_dn, Methods(quantization=quantization))
        for e in electrons_up_to(brightest_dn, pixel, pixel.offset_dn)
    ]
    promised = saturation.Saturation().range_dn(made.view, brightest_dn, Methods(quantization=quantization))
    assert promised == pytest.approx(float(max(changes) - min(changes)), abs=1e-9)


def test_a_whole_pedestal_cancels_to_the_last_digit() -> None:
    """Also of values that lie one digit of a float from a step, which a sum with the pedestal would lose."""
    made = scene("one", "RGGB", {}, {"offset_dn": 4_000_000.0, "bits": 24, "well_e": 1e7, "gain_dn_per_e": 1.0})
    steps = np.arange(1, 41) + 0.5
    electrons = np.concatenate([np.nextafter(steps, 0), steps, np.nextafter(steps, 99)])
    with_it = Imager(made.view).readout.transfer(electrons)
    without = Imager(scene("one", "RGGB", {}, {"bits": 24, "well_e": 1e7, "gain_dn_per_e": 1.0}).view).readout.transfer(
        electrons
    )
    np.testing.assert_array_equal(with_it - without, 4_000_000.0)
    np.testing.assert_array_equal(
        without, np.repeat([[0], [1], [1]], 40, axis=1).ravel() + np.tile(np.arange(1, 41), 3)
    )


def means(electrons: float, pixel: Pixel, offset: float, *, rounds: bool, law: str) -> float:
    """Mean readout of one pixel by brute force: a sum over electrons of steps that read noise passes."""
    spread = 12 * math.sqrt(electrons) + 12
    if law == "Poisson":
        counts = np.arange(max(0, math.floor(electrons - spread)), math.ceil(electrons + spread) + 1.0)
        weights = poisson.pmf(counts, electrons)
    else:
        z = np.linspace(-8, 8, 801)
        counts, weights = electrons + z * math.sqrt(electrons), norm.pdf(z) * (z[1] - z[0])
    held = pixel.dn_per_e * np.minimum(counts, pixel.well_e) + offset
    sigma = pixel.dn_per_e * pixel.read_noise_e
    top = pixel.full_scale_dn
    if rounds:
        edges = np.arange(1, top + 1) - 0.5
        passed = (held[:, None] >= edges) if sigma == 0 else ndtr((held[:, None] - edges) / sigma)
        return float(weights @ passed.sum(axis=1))
    if sigma == 0:
        return float(weights @ np.clip(held, 0, top))
    z_low, z_high = held / sigma, (held - top) / sigma
    above = sigma * (norm.pdf(z_low) + z_low * ndtr(z_low))
    return float(weights @ (above - sigma * (norm.pdf(z_high) + z_high * ndtr(z_high))))


@pytest.mark.parametrize("law", ["Poisson", "Gaussian"])
@pytest.mark.parametrize("rounds", [False, True])
@pytest.mark.parametrize("read_noise_e", [0.0, 0.3, 4.0])
@pytest.mark.parametrize(
    ("offset", "brightest_e"), thinned([(8.0, 300.0), (0.3, 300.0), (16.25, 600.0), (40.0, 900.0)], 3)
)
def test_the_pedestal_under_noise(
    law: str, rounds: bool, read_noise_e: float, offset: float, brightest_e: float
) -> None:
    given = {"offset_dn": offset, "bits": 8, "well_e": 650.0, "gain_dn_per_e": 0.4, "read_noise_e": read_noise_e}
    made = scene("one", "RGGB", {"noise": True}, given)
    pixel = made.view.pixel
    grid = np.concatenate([np.linspace(0, 4, 6), np.linspace(5, brightest_e, 12), brightest_e - np.linspace(0, 3, 4)])
    changes = [
        means(e, pixel, offset, rounds=rounds, law=law) - means(e, pixel, 0.0, rounds=rounds, law=law) for e in grid
    ]
    methods = Methods(quantization="round" if rounds else "skip")
    promised = pedestal.Pedestal().range_dn(made.view, brightest_e * pixel.dn_per_e, methods)
    assert max(changes) - min(changes) <= promised + 1e-6
