"""The readers where the answer is known, and what they may not know."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.special import ndtr

from sweep.features.vision.crops import Crops, Heads
from sweep.features.vision.image_kernels import draw_numbers, log_likelihoods
from sweep.features.vision.images import HeadCamera
from sweep.features.vision.lamps import CHECK, TEST, TRAIN, Lamps, split_lamps
from sweep.features.vision.observer import posteriors
from sweep.features.vision.pixel_table import pixel_table
from sweep.features.vision.prototypes import Prototypes
from sweep.features.vision.scenes import FIXED, ORDERS, SHUFFLED, draw_scenes
from sweep.features.vision.scores import confusion_matrix, costs, mean_of

from ...build import BASE, issues, load
from ...cases import thinned
from .heads import NO_FILTERS, head_setup, vision

TWO = ["red", "orange"]


def test_the_likelihood_errs_as_two_gaussians_do() -> None:
    """Sixteen bright pixels of two known images: the least error is that of Gaussians apart by d'."""
    pixel = head_setup().camera.pixel
    held = pixel_table(pixel)
    electrons = np.array([np.full(16, 2000.0), np.full(16, 2030.0)])
    node, share = held.at(electrons)
    n, rng = 20_000, np.random.default_rng(2)
    truth = rng.integers(2, size=n)
    numbers = np.empty(n * 16, dtype=np.int16)
    draw_numbers(node[truth].ravel(), share[truth].ravel(), held.below, rng.random(n * 16), numbers)
    found = np.empty((n, 2))
    log_likelihoods(numbers.reshape(n, 16), node, share, held.shares, found)
    variance = 2015 + (0.01 * 2015) ** 2 + pixel.read_noise_e**2 + 1 / 12 / pixel.dn_per_e**2
    least = ndtr(-0.5 * 30 * np.sqrt(16 / variance))
    assert 0.05 < least < 0.2
    assert (found.argmax(axis=1) != truth).mean() == pytest.approx(least, abs=0.01)
    likely = np.exp(found - found.max(axis=1, keepdims=True))
    doubt = 1 - (likely / likely.sum(axis=1, keepdims=True)).max(axis=1)
    assert doubt.mean() == pytest.approx(least, abs=0.005)


def cameras(cfa: str = "RGGB", **changes: object) -> tuple[HeadCamera, dict[str, Lamps]]:
    requested, setup = vision(**changes), head_setup(cfa)
    return HeadCamera(setup, NO_FILTERS, requested), split_lamps(setup.lights, requested, (1, 0))


def test_crops_are_the_middle_of_images() -> None:
    """Of one head and its lamps, mean and noise are those of whole images in units of the noise."""
    camera, lamps = cameras()
    crops, n = Crops(camera, lamps[TRAIN], (1, 0)), 4000
    scenes = draw_scenes(camera.vision, lamps[TRAIN], SHUFFLED, n, (5,))
    zeros = np.zeros(n, dtype=int)
    members = lamps[TRAIN].of_lens[0]
    same = replace(
        scenes,
        **dict.fromkeys(("distance", "level", "background", "order"), zeros),  # type: ignore[arg-type]
        **{"state": zeros + 1, "lamp": members[np.arange(n) % members.size], "intensity": zeros + 1},
        **{"phantom": zeros + 1, "place": zeros + 0.0},
    )
    whole = crops.seen(camera.images(same), same, fixed=False).crops
    alone = crops.draw(0, 0, Heads(zeros, zeros + 1, zeros, zeros + 1, zeros, zeros))
    assert whole.shape == alone.shape == (n, 144)
    apart = (whole.mean(axis=0) - alone.mean(axis=0)) / np.sqrt((whole.var(axis=0) + alone.var(axis=0)) / n)
    assert np.abs(apart).max() < 4.5
    assert apart.std() < 1.2
    np.testing.assert_allclose(whole.std(axis=0) / alone.std(axis=0), 1.0, atol=0.08)


def test_crops_are_all_different_and_the_same_again() -> None:
    camera, lamps = cameras()
    first, again = (Crops(camera, lamps[TRAIN], (1, 0)) for _ in range(2))
    heads = first.random(0, 500)
    drawn = first.draw(0, 0, heads)
    np.testing.assert_array_equal(drawn, again.draw(0, 0, again.random(0, 500)))
    assert len(np.unique(drawn, axis=0)) == 500
    assert not (drawn == first.draw(0, 0, heads)).all(axis=1).any()


def test_a_reader_is_better_with_more_images_and_never_than_the_observer() -> None:
    """Expected errors by the observer's probabilities, of lamps that it has not learned from."""
    camera, lamps = cameras("RYYCy", test_images=400)
    scenes = draw_scenes(camera.vision, lamps[TEST], SHUFFLED, 400, (8,))
    numbers = camera.images(scenes)
    known = posteriors(camera, scenes, numbers, lamps[TEST], SHUFFLED)
    risks, wrong = [], []
    for images in (1500, 60_000):
        crops = Crops(camera, lamps[TRAIN], (1, 0))
        reader = Prototypes(crops, images)
        said = reader.log_probabilities(crops.seen(numbers, scenes, fixed=False)).argmax(axis=1)
        risks.append((1 - known[np.arange(400), said]).mean())
        wrong.append((said != scenes.state).astype(float))
    least = (1 - known.max(axis=1)).mean()
    assert least < risks[1] < risks[0] < 0.75
    worse = wrong[1] - (known.argmax(axis=1) != scenes.state)
    assert worse.mean() > -3 * worse.std() / np.sqrt(400)
    assert abs((wrong[1] - risks[1]).mean()) < 4 * wrong[1].std() / np.sqrt(400)


def test_prototypes_know_the_order_that_they_are_told() -> None:
    """In the street's order the place of the lit lens says its type."""
    camera, lamps = cameras("RCCC", distances_m=[150.0])
    scenes = draw_scenes(camera.vision, lamps[TEST], FIXED, 300, (8,))
    crops = Crops(camera, lamps[TRAIN], (1, 0))
    reader, numbers = Prototypes(crops, 60_000), camera.images(scenes)
    wrong = [
        (reader.log_probabilities(crops.seen(numbers, scenes, fixed=told)).argmax(axis=1) != scenes.state).mean()
        for told in (True, False)
    ]
    assert wrong[0] < 0.5 * wrong[1]


DIM: dict[str, object] = {"distances_m": [500.0], "intensities_cd": [3.0, 10.0]}
BY_DAY = {"day": {"illuminance_lx": 4e4, "exposure_s": 0.011}}
BRIGHT: dict[str, object] = {"distances_m": [400.0], "intensities_cd": [10.0, 50.0], "levels": BY_DAY}
"""The large photodiode of clear pixels is full."""
HDR = {"offset_dn": 64.0, "captures": "split_pixel", "prnu": 0.005}


@pytest.mark.parametrize(
    ("order", "changes", "pixel"),
    thinned([(SHUFFLED, DIM, {}), (FIXED, DIM, {}), (SHUFFLED, BRIGHT, HDR), (SHUFFLED, DIM | {"lenses": TWO}, {})], 3),
)
def test_the_observer_is_as_often_wrong_as_it_says(
    order: str, changes: dict[str, object], pixel: dict[str, object]
) -> None:
    """A likelihood that left something random out, or counted it wrongly, would be too sure, or not sure enough."""
    requested, setup = vision(**changes), head_setup("RCCC", **pixel)
    camera, lamps = HeadCamera(setup, NO_FILTERS, requested), split_lamps(setup.lights, requested, (1, 0))[TEST]
    scenes = draw_scenes(requested, lamps, order, 600, (8, ORDERS.index(order)))
    found = posteriors(camera, scenes, camera.images(scenes), lamps, order)
    wrong = (found.argmax(axis=1) != scenes.state).astype(float)
    doubt = 1 - found.max(axis=1)
    assert 0.05 < wrong.mean() < 0.6
    assert abs((wrong - doubt).mean()) < 4 * (wrong - doubt).std() / np.sqrt(600)
    for state in range(found.shape[1]):  # each probability is the share of its state, not the largest alone
        off = (scenes.state == state) - found[:, state]
        assert abs(off.mean()) < 4 * off.std() / np.sqrt(600)


def test_lamps_of_the_test_are_nowhere_else() -> None:
    lights = head_setup().lights
    for seed in range(5):
        parts = split_lamps(lights, vision(), (1, seed))
        digests = {name: lamps.digests(lights) for name, lamps in parts.items()}
        assert not digests[TEST] & (digests[TRAIN] | digests[CHECK])
        assert not digests[TRAIN] & digests[CHECK]
        assert [len(digests[name]) for name in (TRAIN, CHECK, TEST)] == [24, 12, 12]


def test_lamps_of_one_spectrum_stay_together() -> None:
    lights = head_setup().lights
    photons = lights.photons.copy()
    red = lights.members["red"]
    photons[red[1::2]] = photons[red[::2]]  # eight pairs of the same lamp
    twins = replace(lights, photons=photons)
    parts = split_lamps(twins, vision(), (1, 0))
    assert sorted(len(parts[name].of_lens[0]) for name in (TRAIN, CHECK, TEST)) == [4, 4, 8]
    assert not parts[TEST].digests(twins) & (parts[TRAIN].digests(twins) | parts[CHECK].digests(twins))


def test_scores() -> None:
    truth, said = np.array([0, 0, 1, 1, 2, 2]), np.array([0, 1, 1, 1, 2, 0])
    matrix = confusion_matrix(truth, said, 3)
    np.testing.assert_array_equal(matrix, [[1, 1, 0], [0, 2, 0], [1, 0, 1]])
    cost, unknown = costs(np.array([True, False, False]), np.array([0.9, 0.7, 0.8]), 0.25)
    np.testing.assert_allclose(cost, [1.0, 0.25, 0.0])
    np.testing.assert_array_equal(unknown, [False, True, False])


def test_an_interval_covers_its_share_in_95_percent() -> None:
    """Of scenes in five seeds whose levels differ; 2,000 draws err by 0.5 % themselves."""
    rng = np.random.default_rng(3)
    seeds, held = np.repeat(np.arange(5), 40), 0
    for _ in range(2000):
        level = np.repeat(0.3 + 0.05 * rng.standard_normal(5), 40)
        found = mean_of(rng.random(200) < level, seeds)
        held += found.low <= 0.3 <= found.high
    assert 0.93 <= held / 2000 <= 0.97


LEVEL = "levels: {day: {illuminance_lx: 1, exposure_s: 1}}"
FAR = f"vision: {{distances_m: [300], {LEVEL}, street: "
MANY = (
    f"vision: {{distances_m: [20, 21, 22, 23], {LEVEL}, lenses: [red, yellow, green, orange], crop_px: 48, "
    "backgrounds: [sky, gray, white, black, soil]"
)
WITH_PIXEL = f"vision: {{distances_m: [100], {LEVEL}}}\npixel: "


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (f"vision: {{distances_m: [100], {LEVEL}, lenses: [red, yelow, green]}}", "vision.lenses"),
        (f"vision: {{distances_m: [100], {LEVEL}, crop_px: 25}}", "crop_px 25 must be even"),
        (f"{WITH_PIXEL}{{bits: 14}}", "pixel.bits"),
        (f"{MANY}}}", "take too much memory"),
        (f"{FAR}{{columns: 60, rows: 3}}}}", "streets of 2160 x 108 pixels"),
        (f"{FAR}{{}}}}".replace("300", "50"), "does not fit"),
        (f"vision: {{distances_m: [100], {LEVEL.replace('day', 'all')}}}", "vision: levels"),
        (
            f"{WITH_PIXEL}{{captures: [{{}}, {{sensitivity: 0.01, qe_factor: {{R: 0.9}}}}]}}",
            "pixel.captures[1].qe_factor",
        ),
        (f"{WITH_PIXEL}{{captures: split_pixel, merge: weighted}}", "pixel.merge"),
        (f"{WITH_PIXEL}{{captures: [{{}}, {{sensitivity: 5.0e-5}}]}}", "pixel.captures: too many readings"),
        (f"{WITH_PIXEL}{{captures: [{{}}, {{sensitivity: 0.1, well_e: 40000}}]}}", "pixel.captures[1].well_e"),
    ],
)
def test_invalid_vision_is_refused(tmp_path: Path, text: str, line: str) -> None:
    (found,) = issues(tmp_path, f"{BASE}{text}\n")
    assert line in found


def test_a_tile_divides_the_images_and_few_classes_are_enough_without_prototypes(tmp_path: Path) -> None:
    text = BASE.replace("cfas: [RGGB, RYNCy]", "cfas: {RGGB: , RYNCy: , wide: {tile: [[R, G, B, R, G]]}}")
    (found,) = issues(tmp_path, f"{text}vision: {{distances_m: [100], {LEVEL}}}\n")
    assert "the tile of wide" in found
    load(tmp_path, f"{BASE}{MANY}, prototypes: false}}\n")
