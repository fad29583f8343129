"""HDR pixels: merged captures against Monte Carlo, brute-force distributions and ISETCam's rule; pulsed lamps."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import special, stats

from sweep.base.errors import SweepError
from sweep.camera.camera import Camera
from sweep.camera.captures import NAMED_CAPTURES, Capture
from sweep.camera.model import scene_model
from sweep.camera.mosaic import Mosaic
from sweep.camera.noise import errors as confusion
from sweep.camera.noise.merge import coded, limits_dn, merged
from sweep.camera.pixel import Pixel
from sweep.camera.pwm import exposure_scales, light_in, phases_of
from sweep.camera.scene import FixedExposure, PwmDrive, Scene
from sweep.camera.sensor import BUILT_IN_SENSORS
from sweep.camera.setup import Setup
from sweep.spectra.builtin.registry import BUILT_IN_LIGHTS
from sweep.spectra.spectrum import WavelengthGrid

Array = NDArray[np.float64]
DRAWS = 1_000_000


def chart_setup(scene: Scene, pixel: Pixel) -> Setup:
    """RYNCy with Y in N."""
    grid, mosaic = WavelengthGrid(), Mosaic.from_name("RYNCy")
    sensor, modified = BUILT_IN_SENSORS["ar0820"](grid), (mosaic.channels.index("N"),)
    qe = sensor.mosaic_qe(mosaic, {"N": "Y"})
    return Setup(Camera(grid, mosaic, qe, modified, sensor.qe["C"], pixel), BUILT_IN_LIGHTS["tl16"](grid), scene)


def relative_light(pixel: Pixel) -> Array:
    return np.array([exposure.capture.light for exposure in pixel.exposures])


def exposure_of(pixel: Pixel) -> list[int]:
    """Captures read the same electrons if they have the same light, start, QE and crosstalk."""
    return [[k in e.numbers for e in pixel.exposures].index(True) for k in range(len(pixel.captures))]


def drawn(expected: Array, pixel: Pixel, rng: np.random.Generator, n: int) -> Array:
    """Merged values of n readouts, by the textbook: gain, Poisson, well, read noise, ADC; then the rule."""
    light, at, limits = relative_light(pixel), exposure_of(pixel), limits_dn(pixel)
    gain = 1 + pixel.prnu * rng.standard_normal(n)
    counts = [rng.poisson(np.maximum(e * gain, 0)) for e in expected]
    read = []
    for k, one in enumerate(pixel.read_as):
        e = np.minimum(counts[at[k]], one.well_e) + one.read_noise_e * rng.standard_normal(n)
        read.append(np.clip(np.floor(e * one.dn_per_e + one.offset_dn + 0.5), 0, one.full_scale_dn))
    usable = np.array([np.full(n, True) if c is None else dn < c for dn, c in zip(read, limits, strict=True)])
    x = np.array([(dn - o.offset_dn) / o.dn_per_e / light[a] for dn, o, a in zip(read, pixel.read_as, at, strict=True)])
    if pixel.merge == "saturated":
        return pixel.dn_per_e * x[usable.argmax(axis=0), np.arange(n)] + pixel.offset_dn
    value, code = np.empty(n), (usable * 2 ** np.arange(len(read))[:, None]).sum(axis=0)
    for which in np.unique(code):
        some = [k for k in range(len(read)) if which >> k & 1]
        covariance = np.zeros((len(some), len(some)))
        for i, a in enumerate(some):
            for j, b in enumerate(some):
                if at[a] == at[b]:
                    covariance[i, j] += expected[at[a]] / light[at[a]] ** 2
                if a == b:
                    one = pixel.read_as[a]
                    covariance[i, j] += (one.read_noise_e**2 + 1 / (12 * one.dn_per_e**2)) / light[at[a]] ** 2
        weights = np.linalg.solve(covariance, np.ones(len(some)))
        here = code == which
        value[here] = weights / weights.sum() @ x[some][:, here]
    return pixel.dn_per_e * value + pixel.offset_dn


def random_pixel(rng: np.random.Generator, **changes: Any) -> tuple[Pixel, Array]:
    """A pixel and expected electrons of its exposures: dark, at a threshold, or beyond it."""
    captures: Any = str(rng.choice(list(NAMED_CAPTURES)))
    if rng.random() < 0.5:
        light = np.sort(10 ** rng.uniform(-2, 0, 3))[::-1]
        wells = rng.uniform(200, 5_000, 3)
        wells[1:] = np.maximum(wells[1:], light[1:] / light[:-1] * wells[:-1] * rng.uniform(1, 3, 2))
        captures = [{"sensitivity": a, "well_e": w, "bits": 14} for a, w in zip(light, np.sort(wells), strict=True)]
    chosen = {
        "merge": str(rng.choice(["saturated", "weighted"])),
        "offset_dn": float(rng.choice([0, 64, 168])),
        "prnu": float(rng.choice([0, 0.01])),
        "read_noise_e": float(rng.choice([0, 0.5, 3])),
        "threshold": float(rng.choice([0.5, 0.9, 1.0])),
    }
    pixel = Pixel(captures=captures, **(chosen | changes))
    light = relative_light(pixel)
    k = rng.integers(len(pixel.captures))
    full = pixel.read_as[k].saturation_e / light[exposure_of(pixel)[k]]
    near = full * pixel.threshold * rng.uniform(0.97, 1.03)
    return pixel, float(rng.choice([near, full * rng.uniform(0.01, 1.3), 10 ** rng.uniform(-1, 2)])) * light


@pytest.mark.parametrize("seed", range(12))
def test_mean_and_variance_are_those_of_draws(seed: int) -> None:
    rng = np.random.default_rng(seed)
    pixel, expected = random_pixel(rng)
    found = merged(expected[:, None], relative_light(pixel)[:, None], pixel)
    value = drawn(expected, pixel, rng, DRAWS)
    assert found.mean[0] == pytest.approx(value.mean(), abs=4 * value.std() / DRAWS**0.5 + 1e-6)
    spread = (value - value.mean()) ** 2
    rare = 5e-6 * (value.max() - value.min()) ** 2  # a few readouts of another capture, which a million may not show
    tolerance = 4 * spread.std() / DRAWS**0.5 + 1e-9 + rare
    assert found.variance[0] == pytest.approx(spread.mean(), rel=0.02, abs=tolerance)


@cache
def chances_of_codes(well_e: float, dn_per_e: float, offset_dn: float, read_noise_e: float, full_dn: int) -> Array:
    """Probability of each code, of 0 to 5,499 electrons."""
    mean = (np.minimum(np.arange(5_500), well_e) * dn_per_e + offset_dn)[:, None]
    edges = np.concatenate([[-np.inf], np.arange(full_dn) + 0.5, [np.inf]])
    return np.diff(special.ndtr((edges - mean) / (dn_per_e * read_noise_e)), axis=1)


def outcomes(expected: Array, pixel: Pixel) -> dict[float, float]:
    """Probability of each merged value of `merge: saturated` without PRNU, from SciPy's distributions alone."""
    light, at, limits = relative_light(pixel), exposure_of(pixel), limits_dn(pixel)
    found: dict[float, float] = {}
    passed = np.ones(1)
    for g, exposure in enumerate(pixel.exposures):
        wide = 15 * expected[g] ** 0.5 + 60
        counts = np.arange(max(int(expected[g] - wide), 0), int(expected[g] + wide))
        left = stats.poisson.pmf(counts, expected[g]) * passed.sum()
        for k in exposure.numbers:
            one, numbers = pixel.read_as[k], np.arange(pixel.read_as[k].full_scale_dn + 1)
            facts = one.well_e, one.dn_per_e, one.offset_dn, one.read_noise_e, one.full_scale_dn
            chance = chances_of_codes(*facts)[counts]
            usable = numbers < (np.inf if limits[k] is None else limits[k])
            values = (numbers - one.offset_dn) / one.dn_per_e / light[at[k]]
            for value, share in zip(values[usable], left @ chance[:, usable], strict=True):
                found[round(value, 6)] = found.get(round(value, 6), 0.0) + share
            left = left * chance[:, ~usable].sum(axis=1)
        passed = left
    return found


@pytest.mark.parametrize("seed", range(8))
def test_errors_are_those_of_all_outcomes(seed: int) -> None:
    """In every second pixel of gains that vary by 1 %, by a Gauss-Hermite sum."""
    rng = np.random.default_rng(seed)
    captures = [
        {"well_e": 300.0, "read_noise_e": 1.0, "bits": 9},
        {"well_e": 1_200.0, "read_noise_e": 3.0, "bits": 9},
        {"sensitivity": 0.1, "well_e": 900.0, "read_noise_e": 1.0, "bits": 9},
    ]
    pixel = Pixel(captures=captures, offset_dn=20, threshold=0.9, prnu=0.01 * (seed % 2))
    light = relative_light(pixel)
    first = float(rng.choice([260.0, 275.0, 1_050.0, 1_100.0, 3_000.0, 40.0]))
    signals = np.array([first, first * rng.uniform(1.03, 1.3)])
    expected = light[:, None, None, None] * signals[None, None, :, None]
    members = {"one": np.array([0]), "other": np.array([1])}
    found = confusion.errors(expected, [np.array([0])], pixel, members, light[:, None])
    one: dict[float, float] = {}
    other: dict[float, float] = {}
    gains, shares = np.polynomial.hermite_e.hermegauss(20) if pixel.prnu else (np.zeros(1), np.ones(1))
    for gain, share in zip(1 + pixel.prnu * gains, shares / shares.sum(), strict=True):
        for all_values, e in zip((one, other), signals, strict=True):
            for value, chance in outcomes(light * e * gain, pixel).items():
                all_values[value] = all_values.get(value, 0.0) + share * chance
    error = sum(min(one.get(v, 0.0), other.get(v, 0.0)) for v in one | other) / 2
    assert sum(one.values()) == pytest.approx(1, abs=1e-9)
    assert found["one", "other"][0] == pytest.approx(error, rel=0.02)


def test_codes_of_companding_add_their_steps() -> None:
    """12 bits for a merged range of 20."""
    rng = np.random.default_rng(5)
    linear = Pixel(captures="split_pixel", offset_dn=64, prnu=0.005)
    knees = [[1_024.0, 1_024.0], [32_768.0, 2_560.0], [700_000.0, 4_095.0]]
    pixel = Pixel.model_validate(linear.model_dump() | {"companding": knees})
    light = relative_light(pixel)
    for electrons in (30.0, 3_000.0, 15_000.0, 90_000.0):
        found = merged(light[:, None] * electrons, light[:, None], pixel)
        value = coded(drawn(light * electrons, linear, rng, 200_000), pixel)
        assert found.mean[0] == pytest.approx(value.mean(), abs=4 * value.std() / 200_000**0.5 + 0.02 * value.std())
        assert found.variance[0] == pytest.approx(value.var(), rel=0.05)
    signals = light[:, None, None, None] * (electrons * np.array([1.0, 1.05]))[None, None, :, None]
    members = {"one": np.array([0]), "other": np.array([1])}
    without, with_codes = (
        confusion.errors(signals, [np.array([0])], one, members, light[:, None])["one", "other"][0]
        for one in (linear, pixel)
    )
    assert with_codes > 0.97 * without  # whose own bins cost up to 2 %


def test_pixels_of_one_electron() -> None:
    tiny = Pixel(captures=[{"well_e": 1.0, "bits": 1}, {"sensitivity": 0.5, "well_e": 1.0, "bits": 1}], threshold=1.0)
    found = merged(np.array([[1.0], [0.5]]), np.array([[1.0], [0.5]]), tiny)
    assert np.isfinite([found.mean, found.variance]).all()


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"captures": [{"sensitivity": 0.1}, {}]}, "captures.1 is more sensitive"),
        ({"captures": "split"}, "one of split_pixel, dual_gain, staggered"),
        ({"captures": [{}], "companding": [[100.0, 50.0], [90.0, 60.0]]}, "knees must ascend"),
        ({"captures": [{}], "companding": [[100.0, 50.0]]}, "the last knee must be at 4095 DN or more"),
        ({"companding": [[5000.0, 50.0]]}, "companding needs captures"),
        ({"captures": [{"crosstalk": 0.1}]}, "needs a crosstalk of the pixel"),
        ({"captures": [{}, {"sensitivity": 1e-6}]}, "full sensitivity has 1.11e.10 electrons; allowed: at most 1e.09"),
        ({"captures": [{"bits": 4}], "offset_dn": 20.0}, "captures.0: offset_dn 20 must be below full scale, 15"),
    ],
)
def test_unsuitable_captures_are_refused(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(SweepError, match=said):
        Pixel(**changes)


def test_qe_and_crosstalk_of_a_photodiode_change_its_electrons() -> None:
    scene = Scene(noise=True)
    setup = chart_setup(scene=scene, pixel=Pixel(read_noise_e=2, offset_dn=64, crosstalk=0.02))
    small = Capture(sensitivity=0.1, qe_factor={"R": 0.5}, crosstalk=0.1)
    hdr = setup.with_camera(pixel=setup.camera.pixel.model_copy(update={"captures": (Capture(), small)}))
    curves = setup.camera.base_qe[None]
    electrons = scene_model(hdr).pixel_electrons(curves)
    factor = np.where(np.array(hdr.camera.mosaic.channels) == "R", 0.5, 1.0)
    other = setup.with_camera(
        qe=setup.camera.qe * factor[:, None], pixel=setup.camera.pixel.model_copy(update={"crosstalk": 0.1})
    )
    modified = curves * factor[list(setup.camera.modified)][:, None]
    np.testing.assert_allclose(electrons[1], 0.1 * scene_model(other).pixel_electrons(modified)[0], rtol=1e-12)
    np.testing.assert_allclose(electrons[0], scene_model(setup).pixel_electrons(curves)[0], rtol=1e-12)


@pytest.mark.parametrize("duty", [0.05, 0.9])
def test_light_in_windows_is_that_of_all_phases(duty: float) -> None:
    """100,000 phases by a lamp that is on or off at each of 400,000 instants of a period; the extremes are at the corners."""
    drive = PwmDrive(duty=duty, frequency_hz=90.0)
    phases = (np.arange(100_000) + 0.5) / 100_000
    for start, length in ((0.0, 0.99), (1.3, 2.4)):
        instants = (np.arange(400_000) + 0.5) / 400_000 * length
        for phase in phases[::20_011]:
            on = np.mod(phase + start + instants, 1.0) < duty
            assert on.mean() / duty == pytest.approx(float(light_in(drive, phase + start, np.array(length))), abs=1e-4)
    scene = Scene(exposure=FixedExposure(exposure_s=0.011), drive=drive, noise=True)
    setup = chart_setup(scene=scene, pixel=Pixel(captures="staggered", read_noise_e=2))
    corners = phases_of(setup, np.array([0.011]), 0)[0]
    everywhere = exposure_scales(setup, np.array([0.011]), phases[None])[:, 0]
    at_corners = exposure_scales(setup, np.array([0.011]), corners[None])[:, 0]
    assert (at_corners.min(axis=1) <= everywhere.min(axis=1) + 1e-12).all()
    assert (at_corners.max(axis=1) >= everywhere.max(axis=1) - 1e-12).all()
    np.testing.assert_allclose(at_corners.min(axis=1), everywhere.min(axis=1), atol=1e-3)
