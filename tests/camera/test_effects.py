"""Every effect against a formula, a brute force or a simulation that shares no code with it."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.ndimage import convolve
from scipy.special import j0, j1

from sweep.camera import irradiance, psf, pwm, sampling
from sweep.camera.linear import linear_model
from sweep.camera.pixel import Pixel
from sweep.camera.scene import FixedExposure, PwmDrive, Scene, Target
from sweep.spectra.color import luminance_per_photon_radiance
from sweep.spectra.spectrum import LIGHT_M_S, PLANCK_J_S, WavelengthGrid

from ..hard.scenes import FAR, NEAR, TILES, scene, target


def disc_by_energy(radius: float, r: float, wavelength: float, f_number: float) -> float:
    """Image of a disc at r, from the encircled energy 1 - J0^2 - J1^2 (Rayleigh) around r: another integral."""
    k = math.pi / (wavelength * f_number)
    if r == 0:
        return 1 - j0(k * radius) ** 2 - j1(k * radius) ** 2

    def ring(s: float) -> float:
        inside = math.acos(max(-1.0, min(1.0, (s * s + r * r - radius * radius) / (2 * s * r)))) / math.pi
        return 2 * j1(k * s) ** 2 / s * inside

    ends = sorted({0.0, abs(radius - r), radius + r})
    return sum(quad(ring, a, b, limit=2000, epsabs=1e-10)[0] for a, b in pairwise(ends))


@pytest.mark.parametrize(("radius", "f_number"), [(6.2, 2.0), (18.9, 4.0), (1.0, 1.4), (3.0, 16.0)])
def test_the_image_of_a_disc(radius: float, f_number: float) -> None:
    waves = np.array([0.4, 0.55, 0.7])
    profile = psf.DiscProfile(radius, 2 * radius, waves, f_number, 0.0)
    for r in (0.0, 0.3 * radius, 0.95 * radius, radius, 1.3 * radius):
        found = profile.at(np.array([r]))[0]
        exact = [disc_by_energy(radius, r, wave, f_number) for wave in waves]
        np.testing.assert_allclose(found, exact, atol=5e-6)  # of the spline, see `test_disc_image`


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9, 1.2])
def test_the_transfer_function_out_of_focus_is_the_autocorrelation_of_the_pupil(share: float) -> None:
    """An integral over the overlap of two shifted pupils."""

    def overlap(x: float) -> float:
        return 4 / math.pi * math.cos(8 * math.pi * 0.7 / 0.55 * share * x) * math.sqrt(max(0.0, 1 - (x + share) ** 2))

    exact = quad(overlap, 0, max(0.0, 1 - share), epsabs=1e-10, limit=200)[0]
    found = psf.otf(np.array([share / 1.1]), np.array([0.55]), 2.0, 0.7)[0, 0]
    assert found == pytest.approx(exact, abs=1e-8)


@pytest.mark.parametrize("name", list(TILES))
def test_readouts_weigh_each_channel_to_one(name: str) -> None:
    mosaic = TILES[name]
    n = len(mosaic.channels)
    places = np.random.default_rng(1).uniform(0, 4, (5, 2))
    seen = sampling.window(mosaic, places, 5.0)
    for weights in (
        sampling.center_weights(seen, np.rint(places) - places, mosaic),
        sampling.mean_weights(seen, 0.5, 3.0, n),
    ):
        assert (weights >= 0).all()
        for channel in range(n):
            np.testing.assert_allclose(weights[:, seen.channel == channel].sum(axis=1), 1.0)


def test_demosaicking_a_bayer_tile_is_bilinear() -> None:
    seen = sampling.window(TILES["RGGB"], np.array([[0.0, 0.0]]), 3.0)
    weights = sampling.center_weights(seen, np.zeros((1, 2)), TILES["RGGB"])[0]
    row, column = (int(np.abs(a).argmin()) for a in (seen.dy[0, :, 0], seen.dx[0, 0]))
    around = weights[row - 1 : row + 2, column - 1 : column + 2]
    np.testing.assert_allclose(around, [[0.25, 0.25, 0.25], [0.25, 1.0, 0.25], [0.25, 0.25, 0.25]])
    assert weights.sum() == pytest.approx(3.0)


def test_crosstalk_is_a_convolution() -> None:
    rng = np.random.default_rng(2)
    light = rng.uniform(size=(1, 4, 5))
    kernel = np.array([[0, 0.05, 0], [0.05, 0.8, 0.05], [0, 0.05, 0]])
    found = sampling.with_crosstalk(light, 0.2)
    np.testing.assert_allclose(found[0], convolve(light[0], kernel, mode="constant"), rtol=1e-12)


def test_extinction_leaves_two_percent_at_the_visibility() -> None:
    for visibility in (100.0, 3000.0, 20_000.0):
        made = scene("fog", "RGGB", {"target": target(visibility, 10), "visibility_m": visibility}).setup
        wave = np.array([450.0, 550.0, 650.0])
        spectral = irradiance.air_transmittance(made.scene, wave)
        assert spectral[1] == pytest.approx(0.02, rel=1e-12)
        assert spectral[0] <= spectral[2]  # haze takes more of the blue; dense fog of all alike
    assert irradiance.size_exponent(400.0) == 0
    assert irradiance.size_exponent(5999.99) == pytest.approx(1.3, abs=1e-3)


@settings(max_examples=60, deadline=None)
@given(st.floats(0.05, 0.95), st.floats(0.05, 5))
def test_flicker_by_sliding_an_exposure_over_the_pulses(duty: float, periods: float) -> None:
    drive = PwmDrive(duty=duty, frequency_hz=100.0)

    def on_before(t: np.ndarray) -> np.ndarray:
        return np.floor(t) * duty + np.minimum(t - np.floor(t), duty)

    starts = np.concatenate([np.linspace(0, 1, 4001), [duty]])
    light = (on_before(starts + periods) - on_before(starts)) / (periods * duty)
    least, most = (float(v[0]) for v in pwm.extremes(drive, np.array([periods / 100])))
    assert least == pytest.approx(light.min(), abs=1e-3 / periods / duty)
    assert most == pytest.approx(light.max(), abs=1e-3 / periods / duty)
    times = np.linspace(periods / 100, 2 * periods / 100, 3001)
    each = pwm.extremes(drive, times)
    assert pwm.smallest(drive, times[0], times[-1]) == pytest.approx(each[0].min(), abs=2e-3)
    assert pwm.largest(drive, times[0], times[-1]) == pytest.approx(each[1].max(), abs=2e-3)


def test_luminance_of_a_traffic_light() -> None:
    assert Scene(intensity_cd=200.0, exposure=FixedExposure(exposure_s=0.01)).luminance_cd_m2 == pytest.approx(
        6366, abs=0.5
    )
    grid = WavelengthGrid()
    line = (grid.nodes_nm == 555).astype(float)
    per_photon = luminance_per_photon_radiance(grid, line[None])[0]
    assert per_photon == pytest.approx(683.002 * PLANCK_J_S * LIGHT_M_S / 555e-9, rel=1e-4)


def test_saturation_ends_at_the_first_of_well_and_adc() -> None:
    assert Pixel().saturation_e == pytest.approx(10_000)
    assert Pixel(gain_dn_per_e=0.5, offset_dn=95.0).saturation_e == pytest.approx(8000)
    assert Pixel(gain_dn_per_e=0.1).saturation_e == pytest.approx(10_000)


def test_focal_length_gives_the_pixels_per_radian() -> None:
    assert Target(**FAR).focal_length_um(2.1) == pytest.approx(2.1 * 3840 / math.radians(30))
    assert Target(**FAR).object_resolution_px == pytest.approx(5.9, abs=0.05)


@pytest.mark.parametrize("off_axis_deg", [0.0, 25.0, 50.0])
def test_light_off_axis_falls_with_the_fourth_power_of_the_cosine(off_axis_deg: float) -> None:
    lit = {"exposure": {"kind": "fixed", "exposure_s": 2e-3}, "background_cd_m2": 300.0, "target": NEAR}
    scenes = [scene("lit", "RGGB", lit | {"off_axis_deg": angle}) for angle in (0.0, off_axis_deg)]
    axial, off_axis = (linear_model(made.setup).smooth(made.curves) for made in scenes)
    share = (1 + math.tan(math.radians(off_axis_deg)) ** 2) ** -2
    np.testing.assert_allclose(off_axis, share * axial, rtol=1e-12)
