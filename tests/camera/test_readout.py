"""Mean and variance of a digital number against sums over electrons and steps that share no code with them."""

from __future__ import annotations

import numpy as np
import pytest

from sweep.camera.model import SceneModel
from sweep.camera.noise import moments
from sweep.camera.noise.law import pixel_law
from sweep.camera.pixel import Pixel

from .. import readout_oracle
from ..cases import thinned
from ..hard.scenes import scene


def random_pixel(seed: int) -> tuple[Pixel, list[float]]:
    """Any pixel, and electrons from the dark to beyond its ends; full wells below and beyond the end of the ADC."""
    rng = np.random.default_rng([seed, 23])
    bits = int(rng.integers(8, 17))
    gain = float(10 ** rng.uniform(-2, 1.3))
    offset = float(rng.uniform(0, min(200, 2**bits / 3))) if rng.uniform() < 0.7 else 0.0
    adc_e = (2**bits - 1 - offset) / gain
    well = float(min(adc_e * 10 ** rng.uniform(-1, 0.3), 3e4)) if rng.uniform() < 0.7 else 3e4
    read = float(rng.choice([0.0, 0.05, 0.3, 1.0, 2.0, 5.0, 30.0]))
    pixel = Pixel(bits=bits, well_e=max(well, 20.0), gain_dn_per_e=gain, read_noise_e=read, offset_dn=offset)
    end = min(pixel.well_e, adc_e)
    return pixel, [
        float(v) for v in (10 ** rng.uniform(-3, 0), end * rng.uniform(0.01, 1), end * rng.uniform(0.95, 1.05))
    ]


def check(pixel: Pixel, electrons: float) -> None:
    """Sums to 1e-9 of the noise and 1e-13 of full scale; the table's cubic within 5/384 / 64^4 of a 4th derivative."""
    mean, variance = readout_oracle.moments(electrons, pixel)
    _, exact, spread = moments.moments(np.array([electrons]), pixel)[:, 0]
    wide = pixel.dn_per_e * np.sqrt(electrons + pixel.read_noise_e**2 + (pixel.prnu * electrons) ** 2)
    wide = min(wide, pixel.full_scale_dn) + 1
    assert exact == pytest.approx(mean, abs=1e-9 * wide + 1e-12 * pixel.full_scale_dn)
    assert spread == pytest.approx(variance, abs=3e-9 * wide**2)
    found = pixel_law(pixel).at(0, np.array([electrons]), 2)[:, 0]
    assert found[0] == pytest.approx(mean, abs=3e-7 * wide)
    assert found[1] == pytest.approx(variance, abs=3e-6 * wide**2)


@pytest.mark.parametrize("seed", thinned(range(25)))
def test_mean_and_variance_are_those_of_every_count_and_step(seed: int) -> None:
    pixel, signals = random_pixel(seed)
    for electrons in signals:
        check(pixel, electrons)


@pytest.mark.parametrize(("read", "gain", "offset"), [(2.0, 0.4, 64.0), (0.1, 0.2, 168.3), (0.0, 3.0, 0.25)])
def test_prnu_spreads_the_gains_of_poisson_electrons(read: float, gain: float, offset: float) -> None:
    pixel = Pixel(well_e=800, gain_dn_per_e=gain, read_noise_e=read, offset_dn=offset, prnu=0.01)
    for electrons in (0.5, 30.0, 700.0, 820.0):
        check(pixel, electrons)


def test_a_whole_pedestal_cancels_to_the_last_digit() -> None:
    """Also of values that lie one digit of a float from a step, which a sum with the pedestal would lose."""
    deep = {"bits": 24, "well_e": 1e7, "gain_dn_per_e": 1.0}
    steps = np.arange(1, 41) + 0.5
    electrons = np.concatenate([np.nextafter(steps, 0), steps, np.nextafter(steps, 99)])
    with_it, without = (
        SceneModel(scene("one", "RGGB", {}, deep | more).setup).readout.convert(electrons)
        for more in ({"offset_dn": 4_000_000.0}, {})
    )
    np.testing.assert_array_equal(with_it - without, 4_000_000.0)
    np.testing.assert_array_equal(
        without, np.repeat([[0], [1], [1]], 40, axis=1).ravel() + np.tile(np.arange(1, 41), 3)
    )


def test_whole_numbers_without_noise() -> None:
    """Clipped at the full well, rounded, cut at the end of the ADC."""
    made = scene("one", "RGGB", {}, {"well_e": 9000.0, "gain_dn_per_e": 0.5, "offset_dn": 3.25}).setup
    electrons = np.linspace(0, 10_000, 100_001)
    expected = np.minimum(np.floor(np.minimum(electrons, (4095 - 3.25) / 0.5) * 0.5 + 3.25 + 0.5), 4095)
    np.testing.assert_array_equal(SceneModel(made).readout.convert(electrons), expected)
