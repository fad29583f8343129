"""The law of a pixel against its sums, the bounds of a walk over brightness against readings, and what it proves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sweep.camera.model import scene_model
from sweep.camera.noise import merge, moments
from sweep.camera.noise.law import pixel_law
from sweep.camera.noise.law_kernels import largest_variances, slopes_between
from sweep.camera.noise.merge import light_of
from sweep.camera.pixel import Pixel
from sweep.camera.scene import Scene
from sweep.metrics.brightness import BrightnessCurves, Walk, curves_of
from sweep.study import load_study

from .brightness_scan import nearest

STUDIES = Path(__file__).parents[2] / "studies"
PIXELS: dict[str, dict[str, Any]] = {
    "read once": {"read_noise_e": 2.0, "prnu": 0.01},
    "coarse steps": {"read_noise_e": 0.3, "bits": 8},
    "split": {"pitch_um": 2.8, "captures": "split_pixel", "read_noise_e": 1.0, "prnu": 0.005},
    "weighted": {"pitch_um": 2.8, "captures": "split_pixel", "merge": "weighted"},
}


@pytest.mark.parametrize("of", PIXELS.values(), ids=PIXELS)
def test_a_law_is_the_sums_to_a_millionth_of_the_noise_or_a_thousandth_of_merged_noise(of: dict[str, Any]) -> None:
    pixel = Pixel(**of)
    light = light_of(pixel) if pixel.captures else np.ones(1)
    law = pixel_law(pixel, (tuple(light),), noisy=True)
    electrons = np.sort(np.concatenate([np.geomspace(0.01, 1.2 * law.ends[0], 400), np.linspace(0, law.ends[0], 400)]))
    if pixel.captures:
        merged = merge.merged(electrons * light[:, None], light[:, None], pixel)
        expected = merged.mean, merged.variance
    else:
        expected = moments.moments(electrons, pixel)[1:]
    mean, variance, _, _ = law.at(0, electrons)
    assert (np.abs(mean - expected[0]) / np.sqrt(expected[1] + 1e-3)).max() < (1e-3 if pixel.captures else 1e-6)
    np.testing.assert_allclose(variance, expected[1], rtol=5e-3 if pixel.captures else 1e-5, atol=1e-3)


def curves_in(name: str, scenario: str, cfa: str = "RGGB") -> tuple[list[BrightnessCurves], dict[str, np.ndarray]]:
    study = load_study(STUDIES / f"{name}.yaml").with_plans()
    space = next(space for space in study.spaces if space.name == cfa)
    setup = study.setup(space, next(of for of in study.scenarios if scenario in of))
    curves = space.curves(space.points(0, 1), study.grid.size)
    return curves_of(scene_model(setup.over_brightness).lamps(curves), setup), dict(setup.members)


@pytest.mark.parametrize("name", ["hdr", "exposure", "pixel"])
def test_bounds_between_two_brightnesses_hold(name: str) -> None:
    random = np.random.default_rng(3)
    lamps = curves_in(name, "")[0][0].lamps
    n_channels, slopes = lamps.weights.shape[1], np.empty((4, lamps.weights.shape[1]))
    for lamp in random.integers(lamps.n_signals, size=12):
        low, high = np.sort(np.exp(random.uniform(-8, 8, 2)))
        factors = np.linspace(low, high, 400)
        mean, variance = (values[0] for values in lamps.moments(np.array([lamp]), factors[None]))
        slopes_between(low, high, int(lamp), lamps.in_kernels, slopes)
        most = np.empty((lamps.n_signals, 1, n_channels))
        largest_variances(lamps.in_kernels, np.full((lamps.n_signals, 1), high), most)
        for values, least, largest in ((mean, slopes[0], slopes[1]), (variance, slopes[2], slopes[3])):
            steps = np.diff(values, axis=0) / np.diff(factors)[:, None]
            room = 1e-9 * np.abs(values).max(axis=0) / (factors[1] - factors[0]) + 1e-6 * np.abs(steps).max(axis=0)
            assert (steps >= least - room).all()
            assert (steps <= largest + room).all()
        assert (variance <= most[lamp] * (1 + 1e-9) + 1e-9).all()


@pytest.mark.parametrize(
    ("name", "scenario"),
    [("hdr", "=1"), ("hdr", "=10000"), ("exposure", "s=0.01"), ("fog", "m=50"), ("noise", "m=50"), ("night", "pulsed")],
)
def test_nothing_is_left_unproven(name: str, scenario: str) -> None:
    curves, members = curves_in(name, scenario)
    for of_cases in curves[:4]:
        for noise in (False, True):
            of_cases.nearest(members["yellow"], members["red"], noise=noise, margin=1.1)
        assert of_cases.unproven == 0


@pytest.mark.parametrize("merge_rule", ["saturated", "weighted"])
@pytest.mark.parametrize("noise", [False, True])
def test_exposures_without_a_fixed_share_of_the_light_are_followed_as_they_read(
    merge_rule: str, *, noise: bool
) -> None:
    """A small photodiode with crosstalk of its own, against a scan."""
    study = load_study(STUDIES / "hdr.yaml").with_plans()
    space = next(space for space in study.spaces if space.name == "RGGB")
    setup = study.setup(space, next(iter(study.scenarios)))
    captures = ({"well_e": 9000}, {"sensitivity": 0.02, "well_e": 8000, "crosstalk": 0.05})
    pixel = Pixel(pitch_um=2.8, crosstalk=0.1, captures=captures, merge=merge_rule, offset_dn=64.0, read_noise_e=1.0)
    target = {"distance_m": 400, "fov_deg": 60, "phase_px": [0.3, 0.1]}
    scene = Scene.model_validate(setup.scene.model_dump(exclude_none=True) | {"target": target, "intensity_cd": 16.0})
    setup = replace(setup, scene=scene, left_out=frozenset()).with_camera(pixel=pixel)
    curves = space.curves(space.points(0, 1), study.grid.size)
    (lamps,) = scene_model(setup.over_brightness).lamps(curves)
    assert not lamps.proportional
    first, second = (np.asarray(setup.members[name])[:5] for name in ("yellow", "red"))
    (of_case,) = curves_of([lamps], setup)
    walk = Walk.of([of_case], 1, first, second, noise=noise)
    expected = nearest(lamps, first, second, noise=noise)[0]
    assert walk.distances[0] == pytest.approx(expected, rel=1e-5)
    assert of_case.follow(walk.pairs, noise=noise)[0] == pytest.approx(expected, rel=1e-5)
