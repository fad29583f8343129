"""Lamps of unknown brightness against scans of lamps of every brightness, and against what pixels that fill must read."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sweep.base.errors import StudyError
from sweep.camera.model import SceneModel, scene_model
from sweep.camera.noise import merge
from sweep.camera.noise.law import pixel_law
from sweep.camera.pixel import Pixel
from sweep.camera.setup import Setup
from sweep.metrics.evaluate import evaluate
from sweep.spectra.lights import Lights, Pair, class_pairs, pair_name
from sweep.study import Study, load_study

from ..hard import random_scenes
from ..hard.scenes import scene, target
from ..margin import near_squared_dprime
from ..readout_oracle import pixels_of

PAIR = ("yellow", "red")
_BASINS = 16
STUDY = """\
study: full
sensor: ar0820
lights: tl16
scenarios:
  lamp:
    optics: {f_number: 2}
    exposure: {kind: fixed, exposure_s: 0.001}
    each: {intensity_cd: [1, 10, 100, 1000, 3000]}
cfas: [RGGB, RYYCy]
"""


def chromatic(study: Study, cfa: str, scenario: str, name: str = "chromatic_csd_yellow_red", **changes: Any) -> float:
    """A chromatic figure of a plain CFA, in a scene with some changes."""
    space = next(space for space in study.spaces if space.name == cfa)
    setup = study.setup(space, scenario)
    setup = replace(setup, scene=setup.scene.model_copy(update=changes))
    return float(evaluate(scene_model(setup), space.curves(space.points(0, 1), study.grid.size), study.states)[name][0])


@pytest.fixture(scope="module")
def full(tmp_path_factory: pytest.TempPathFactory) -> Study:
    path = tmp_path_factory.mktemp("full") / "full.yaml"
    path.write_text(STUDY)
    return load_study(path)


def test_a_range_of_brightness_leaves_out_other_lamps(full: Study) -> None:
    study, at = full, "lamp intensity_cd=1000"
    known = chromatic(study, "RGGB", at, brightness=(1.0, 1.0))
    assert known == pytest.approx(chromatic(study, "RGGB", at, "csd_yellow_red"), abs=1)
    some = [chromatic(study, "RGGB", at, brightness=(1 / most, most)) for most in (1.5, 2.0, 4.0, 8.0)]
    assert known >= some[0] > some[1] > some[2] >= some[3]
    assert some[3] == pytest.approx(0, abs=1e-6)


def test_a_range_of_brightness_ascends(tmp_path: Path) -> None:
    path = tmp_path / "full.yaml"
    path.write_text(STUDY.replace("    optics:", "    brightness: [2, 1]\n    optics:"))
    with pytest.raises(StudyError, match="brightness: 2 must be at most 1"):
        load_study(path)


@pytest.mark.parametrize(
    ("cfa", "intensity_cd", "expected"),
    [("RYYCy", 133.0, 6.749e-3), ("RCCB", 3.16, 6.187e-3), ("RYYCy", 1.0, 1.759e-2)],
)
def test_errors_of_lamps_of_unknown_brightness(cfa: str, intensity_cd: float, expected: float) -> None:
    """Beside a handover, and against lamps that are dimmer than any of a series; expected: scans by `brightness_scan`."""
    study = load_study(Path(__file__).parents[2] / "studies" / "hdr.yaml")
    found = chromatic(study, cfa, "lamp intensity_cd=1", "chromatic_error_yellow_red", intensity_cd=intensity_cd)
    assert found == pytest.approx(expected, rel=2e-3)


class Lamps:
    """Lamps of any brightness in a scene: electrons of two brightnesses, and what pixels read of their multiples."""

    def __init__(self, setup: Setup, curves: np.ndarray) -> None:
        self.setup = setup
        self.noisy = setup.scene.noise is not None
        models = [
            SceneModel(replace(setup, scene=setup.scene.model_copy(update={"intensity_cd": cd}), left_out=left_out))
            for cd in (setup.scene.intensity_cd, 2 * setup.scene.intensity_cd)
            for left_out in [frozenset() if self.noisy else frozenset({"quantization"})]
        ]
        (once, self.weights, self.light), (twice, _, _) = (pixels_of(model, curves, 0) for model in models)
        once, twice = (
            electrons[:, 0] if setup.camera.pixel.captures else electrons[0, 0] for electrons in (once, twice)
        )
        self.lit, self.dark, self.model = twice - once, 2 * once - twice, models[0]

    def read(self, signals: np.ndarray, factors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean and variance of the channels, [n_signals, n_factors, n_channels]."""
        pixel = self.setup.camera.pixel
        electrons = self.dark[..., signals, None, :] + factors[:, None] * self.lit[..., signals, None, :]
        if pixel.captures and self.noisy:
            merged = merge.merged(electrons, self.light[:, None, None], pixel)
            mean, variance = merged.mean, merged.variance
        elif pixel.captures:
            mean = self.first_usable(electrons, pixel)
            variance = np.zeros(mean.shape)
        elif self.noisy:
            mean, variance = pixel_law(pixel).at(0, electrons, 2)
        else:
            mean = np.minimum(electrons, pixel.saturation_e) * pixel.dn_per_e + pixel.offset_dn
            variance = np.zeros(mean.shape)
        return mean @ self.weights, variance @ self.weights**2

    def first_usable(self, electrons: np.ndarray, pixel: Pixel) -> np.ndarray:
        """The first capture below its threshold, in electrons of full sensitivity."""
        light = self.light
        result = np.full(electrons.shape[1:], np.nan)
        for capture, one in enumerate(pixel.read_as):
            exposure = next(at for at, of in enumerate(pixel.exposures) if capture in of.numbers)
            held = np.minimum(electrons[exposure], one.saturation_e)
            last = capture == len(pixel.captures) - 1
            usable = np.isnan(result) & (
                last | (held * one.dn_per_e < pixel.threshold * one.saturation_e * one.dn_per_e)
            )
            result = np.where(usable, held / light[exposure], result)
        return result * pixel.dn_per_e + pixel.offset_dn


def scanned(lamps: Lamps, pair: Pair, *, noise: bool) -> float:
    """The smallest distance to a lamp of 2,000 brightnesses; of the nearest of these, again between their neighbors."""
    members, least = lamps.setup.members, np.inf
    for own, other in (pair, pair[::-1]):
        mean, variance = (values[:, None] for values in lamps.read(members[own], np.ones(1)))

        def squared(factors: np.ndarray) -> np.ndarray:
            there, spread = lamps.read(members[other], factors)  # noqa: B023
            apart = mean - there  # noqa: B023
            if not noise:
                return (apart**2).sum(axis=-1).min(axis=(0, 1))
            spreads = np.maximum(variance, 1e-9), np.maximum(spread, 1e-9)  # noqa: B023
            return near_squared_dprime(apart, *spreads).min(axis=(0, 1))

        coarse = np.concatenate([[0.0], np.geomspace(1e-4, 1e7, 1999)])
        distances = squared(coarse)
        for start in np.argsort(distances)[:_BASINS]:
            ends = coarse[max(start - 1, 0)], coarse[min(start + 1, coarse.size - 1)]
            for _ in range(4):
                finer = np.linspace(*ends, 101)
                of_finer = squared(finer)
                worst = int(of_finer.argmin())
                ends = finer[max(worst - 1, 0)], finer[min(worst + 1, finer.size - 1)]
                least = min(least, float(of_finer[worst]))
    return float(np.sqrt(least))


def random_scene(seed: int) -> tuple[Setup, np.ndarray]:
    """A scene in which some lamps fill pixels, plain or HDR, near or far, with noise or without."""
    rng = np.random.default_rng([seed, 62])
    hdr, noise, far = rng.random(3) < (0.5, 0.5, 0.3)
    pixel: dict[str, Any] = {"offset_dn": float(rng.choice([0, 64, 168])), "well_e": float(rng.choice([2e3, 1e4, 3e4]))}
    pixel |= {"crosstalk": float(rng.choice([0, 0, 0.02])), "read_noise_e": float(rng.uniform(0.5, 5))}
    if hdr:
        pixel |= {"captures": str(rng.choice(["split_pixel", "dual_gain", "staggered"]))}
    if noise and not far:
        pixel |= {"prnu": float(rng.choice([0, 0.005]))}
    at: dict[str, Any] = {"optics": {"f_number": 2}, "exposure": {"kind": "fixed", "exposure_s": 2e-3}}
    at |= {"intensity_cd": float(np.exp(rng.uniform(np.log(20), np.log(20_000))))}
    at |= {"noise": True} if noise else {}
    at |= {"target": target(float(rng.uniform(60, 200)), 60.0)} if far else {}
    at |= {"background_cd_m2": float(rng.choice([0, 0, 20]))}
    made = scene(f"seed {seed}", str(rng.choice(["RGGB", "RCCC", "RYNCy"])), at, pixel)
    return made.setup, made.curves


def assert_no_figure_is_above_a_scan_nor_below(setup: Setup, curves: np.ndarray) -> None:
    lamps = Lamps(setup, curves)
    found = evaluate(scene_model(setup), curves, PAIR if lamps.noisy else ())
    rounding = 0.0 if lamps.noisy or setup.camera.pixel.captures else np.sqrt(len(setup.camera.mosaic.channels))
    asked = [("chromatic_csd", pair, False) for pair in class_pairs(list(setup.members))]
    for metric, pair, noise in (*asked, ("chromatic_dprime", PAIR, True)):
        name = pair_name(metric, pair)
        if name in found and (lamps.noisy or not noise):
            expected, value = scanned(lamps, pair, noise=noise), float(found[name][0])
            # Of an HDR pixel, means are those of a table, good for 0.002 of their noise.
            slack = 0.005 if noise else 1e-3 + rounding + (0.02 if lamps.noisy and setup.camera.pixel.captures else 0)
            assert value <= expected * 1.001 + slack, (name, value, expected)
            assert value >= expected * 0.99 - slack, (name, value, expected)


@pytest.mark.parametrize("first", [0, *(pytest.param(first, marks=pytest.mark.slow) for first in range(10, 30, 10))])
def test_no_chromatic_figure_is_above_a_scan_nor_below(first: int) -> None:
    for seed in range(first, first + 10):
        assert_no_figure_is_above_a_scan_nor_below(*random_scene(seed))


def many_lamps(lights: Lights, count: int, seed: int) -> Lights:
    """So many yellow and red lamps: those of a set, a few nm to either side."""
    rng, names, types, photons = np.random.default_rng(seed), list[str](), list[str](), []
    for kind in ("yellow", "red"):
        for number in range(count):
            own = lights.photons[rng.choice(lights.members[kind])]
            nodes = np.arange(own.size)
            moved = np.interp(nodes + rng.uniform(-1, 1), nodes, own)
            names.append(f"{kind} {number}")
            types.append(kind)
            photons.append(moved / moved.sum() * own.sum())
    return Lights("many", tuple(names), tuple(types), np.array(photons), lights.photon_ratio, "", True)


@pytest.mark.parametrize("captures", [{}, {"captures": "split_pixel"}])
def test_of_forty_lamps_a_type_none_is_nearer(captures: dict[str, str]) -> None:
    at = {"optics": {"f_number": 2}, "exposure": {"kind": "fixed", "exposure_s": 2e-3}, "intensity_cd": 900.0}
    made = scene("many", "RYNCy", at | {"noise": True}, {"offset_dn": 64, "read_noise_e": 2} | captures)
    setup = replace(made.setup, lights=many_lamps(made.setup.lights, 40, 3))
    assert_no_figure_is_above_a_scan_nor_below(setup, made.curves)


def test_designs_without_curves_have_no_chromatic_figures() -> None:
    setup = random_scenes.random_scene(3).setup
    assert setup.scene.noise is not None
    columns = evaluate(SceneModel(setup), np.full((2, 1, setup.camera.grid.size), np.nan), setup.lights.classes[:2])
    assert all(np.isnan(values).all() for name, values in columns.items() if name.startswith("chromatic_"))
    assert "chromatic_error_green_yellow" in columns
