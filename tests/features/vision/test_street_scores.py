"""Scores of boxes by hand, subsets of them, and the coverage of their intervals."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from sweep.features.vision.score_streets import Judge, Subset, _draws, _interval, _of_seed, _subsets

from .heads import vision

BOX = ["left", "top", "width", "height"]
EVERY = np.arange(2)


def test_average_precision_by_hand() -> None:
    """Two lamps: the better box finds one, the next is false, the last finds the other: (1 + 2/3) / 2, by 101 recalls."""
    place = {"left": [5.0, 25.0], "top": 5.0, "width": 4.0, "height": 4.0, "distance_m": 100.0, "state": "red"}
    targets = pd.DataFrame({"image": [0, 1]} | place)
    found = targets.assign(score=[0.9, 0.5])
    false = found.iloc[:1].assign(left=90.0, score=0.7)
    judge = Judge(targets, pd.concat([found, false]), ("red",), 2)
    precision, recall = judge.means(EVERY)
    assert precision[0, 0, 0] == pytest.approx((51 + 50 * 2 / 3) / 101)
    assert recall[0, 0, 0] == 1
    # An image twice is an image more, one that is not there is none.
    precision, recall = judge.means(np.array([1, 1]))
    assert (precision[0, 0, 0], recall[0, 0, 0]) == (1, 1)
    # Boxes that overlap by half alone are right at 0.5 alone.
    half = Judge(targets, targets.assign(score=0.9, width=2.1), ("red",), 2)
    assert half.means(EVERY)[0][0, 0, 0] == 1
    assert half.means(EVERY)[0][1:, 0, 0].max() == 0


def test_a_box_counts_at_the_distance_of_its_size() -> None:
    targets = pd.DataFrame(
        {"image": [0, 1], "state": "red", "level": ["day", "night"], "distance_m": [100.0, 400.0]}
        | {"left": 5.0, "top": 5.0, "width": [8.0, 2.0], "height": [8.0, 2.0]}
    )
    found = targets.assign(score=0.5)
    false = found.iloc[:1].assign(left=50.0, score=0.9)
    requested = vision(distances_m=[100.0, 400.0], lenses=["red", "green"])
    levels = np.array(["day", "night"])
    values = _of_seed(
        requested, ("red", "green"), targets, pd.concat([found, false]), levels, np.empty((0, 2), dtype=int)
    )
    ap50 = {of: row[0, 0] for of, row in values.items()}
    assert ap50[Subset(distance_m=100.0)] == ap50[Subset(state="red", distance_m=100.0)] == pytest.approx(0.5)
    assert ap50[Subset(distance_m=400.0)] == ap50[Subset(level="night")] == pytest.approx(1.0)
    assert ap50[Subset(level="day")] == pytest.approx(0.5)
    assert ap50[Subset()] == ap50[Subset(state="red")] == pytest.approx(2 / 3)
    assert np.isnan(ap50[Subset(state="green")])
    assert len(values) == len([*_subsets(requested, ("red", "green"))])


def simulated(rng: np.random.Generator, n_images: int) -> tuple[pd.DataFrame, dict[str, pd.DataFrame]]:
    """Scenes with lamps of some difficulty, which two designs share, and what a detector finds with each."""
    n = rng.integers(1, 4, size=n_images)
    image = np.repeat(np.arange(n_images), n)
    hard = np.repeat(rng.normal(size=n_images), n) + 0.5 * rng.normal(size=image.size)
    targets = pd.DataFrame({"image": image, "state": "red", "distance_m": 100.0})
    targets = targets.assign(left=20.0 * np.arange(image.size), top=5.0, width=4.0, height=4.0)
    told = {}
    for name, better in (("first", 0.0), ("second", 0.3)):
        score = better - hard + 0.7 * rng.normal(size=image.size)
        right = targets.assign(score=score)[score > -0.8]
        false = right[rng.random(len(right)) < 0.4]
        false = false.assign(left=-100.0, score=false["score"] - 0.8 + 0.5 * rng.normal(size=len(false)))
        told[name] = pd.concat([right, false])
    return targets, told


def apart(rng: np.random.Generator, n_images: int, seeds: int, drawn: bool) -> np.ndarray:
    """AP50 of the second less that of the first, mean over seeds: of all scenes, then of each draw."""
    values = []
    for seed in range(seeds):
        targets, told = simulated(rng, n_images)
        levels = np.where(np.arange(n_images) % 2 == 0, "day", "night")
        every = [np.arange(n_images), *(_draws(levels, (seed, int(rng.integers(2**31)))) if drawn else ())]
        judges = {name: Judge(targets, found, ("red",), n_images, strict=False) for name, found in told.items()}
        ap50 = {name: np.array([judge.means(images)[0][0, 0, 0] for images in every]) for name, judge in judges.items()}
        values.append(ap50["second"] - ap50["first"])
    return np.mean(values, axis=0)


@pytest.mark.slow
def test_intervals_of_differences_cover_their_share() -> None:
    """Of 60 comparisons in 3 seeds of 60 scenes 95 % cover, and are as wide as differences spread, to 3 deviations."""
    rng = np.random.default_rng(7)
    wanted = apart(rng, 20_000, 1, drawn=False)[0]
    assert wanted > 0.05
    intervals = [_interval(apart(rng, 60, 3, drawn=True)) for _ in range(60)]
    covered = sum(interval.low <= wanted <= interval.high for interval in intervals)
    assert covered >= 60 * 0.95 - 3 * (60 * 0.05 * 0.95) ** 0.5
    width = np.mean([interval.high - interval.low for interval in intervals])
    spread = np.std([interval.value for interval in intervals], ddof=1)
    assert width == pytest.approx(2 * 1.96 * spread, rel=3 / (2 * 59) ** 0.5)
