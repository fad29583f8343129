"""Scores of readers of a benchmark's test images."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.features.vision.score import UNKNOWN, images_of_test, read_predictions, scores_of

from ...build import one_line

STATES = ("off", "red", "yellow")


def made_images(n_seeds: int = 5, per_seed: int = 200, seed: int = 3) -> pd.DataFrame:
    """Images of two designs, which show the same scenes, with an observer that errs on a tenth."""
    rng, rows = np.random.default_rng(seed), []
    for number in range(n_seeds):
        states = rng.integers(3, size=per_seed)
        for design_id, name in enumerate(("RGGB", "RYYCy")):
            wrong = rng.random(per_seed) < 0.1
            for at, state in enumerate(states):
                rows.append(
                    {"design_id": design_id, "name": name, "cfa": name, "seed": number, "order": "shuffled"}
                    | {"lamps": "unseen", "image": at, "state": STATES[state], "distance_m": 100.0 + 100 * (at % 2)}
                    | {"level": "day", "observer": STATES[(state + wrong[at]) % 3]}
                )
    frame = pd.DataFrame(rows)
    return images_of_test(pd.concat([frame, frame.assign(lamps="seen")]))


def predicted(folder: Path, table: pd.DataFrame, name: str = "mine.csv") -> Path:
    path = folder / name
    table.to_parquet(path) if name.endswith("parquet") else table.to_csv(path, index=False)
    return path


def test_figures_are_counts(tmp_path: Path) -> None:
    """Errors, unknown answers, costs and differences by hand, from a shuffled file."""
    images, rng = made_images(), np.random.default_rng(1)
    answers = images["observer"].where(rng.random(len(images)) < 0.7, UNKNOWN)
    file = pd.DataFrame({"image_id": images["image_id"], "state": answers}).sample(frac=1, random_state=2)
    reader = read_predictions(predicted(tmp_path, file), images, STATES)
    scores = scores_of(reader, images, 0.2).set_index(["name", "distance_m", "level"])
    wrong, unknown = (answers != images["state"]) & (answers != UNKNOWN), answers == UNKNOWN
    observed = images["observer"] != images["state"]
    for name, distance in (("RGGB", "all"), ("RYYCy", "all"), ("RYYCy", "200.0")):
        row, here = scores.loc[(name, distance, "all")], images["name"] == name
        if distance != "all":
            here &= images["distance_m"] == float(distance)
        assert row["images"] == here.sum()
        assert row["error"] == pytest.approx(wrong[here].mean())
        assert row["unknown"] == pytest.approx(unknown[here].mean())
        assert row["cost"] == pytest.approx(wrong[here].mean() + 0.2 * unknown[here].mean())
        assert row["above_observer"] == pytest.approx(wrong[here].mean() - observed[here].mean())
    whole = scores.loc[(slice(None), "all", "all"), :].droplevel([1, 2])
    assert whole.loc["RYYCy", "apart"] == pytest.approx(whole.loc["RYYCy", "error"] - whole.loc["RGGB", "error"])
    assert np.isnan(scores["calibration_error"]).all()


def test_probabilities_are_calibrated_or_not(tmp_path: Path) -> None:
    """A reader that says 0.8 and is right in 80 % has no calibration error beyond chance; one that says 0.99 has."""
    images, rng = made_images(), np.random.default_rng(5)
    for said, gap in ((0.8, 0.0), (0.99, 0.19)):
        truth = images["state"].map(STATES.index).to_numpy()
        answer = np.where(rng.random(len(images)) < 0.8, truth, (truth + 1) % 3)
        table = np.full((len(images), 3), (1 - said) / 2)
        table[np.arange(len(images)), answer] = said
        file = pd.DataFrame(table, columns=list(STATES)).assign(image_id=images["image_id"].to_numpy())
        scores = scores_of(read_predictions(predicted(tmp_path, file), images, STATES), images, 0.2)
        whole = scores[(scores["distance_m"] == "all") & (scores["level"] == "all")]
        assert whole["calibration_error"].to_numpy() == pytest.approx([gap, gap], abs=0.03)


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (lambda t: t.iloc[3:], "3 images of the test have no answer"),
        (lambda t: pd.concat([t, t.iloc[:2]]), "an image stands twice (and 1 more)"),
        (lambda t: t.assign(image_id=["x", *t["image_id"].iloc[1:]]), "not an image of the test"),
        (lambda t: t.assign(state=["rde", *t["state"].iloc[1:]]), "no state"),
        (lambda t: t.drop(columns="state"), "a column is missing (got 'off')"),
        (lambda t: t.drop(columns="state").assign(off=0.5, red=0.6, yellow=0.1), "no probabilities"),
    ],
)
def test_other_predictions_are_refused_with_a_line(tmp_path: Path, change: object, line: str) -> None:
    images = made_images(2, 20)
    table = images[["image_id"]].assign(state=images["observer"]).reset_index(drop=True)
    path = predicted(tmp_path, change(table))  # type: ignore[operator]
    with one_line(line, alone=False):
        read_predictions(path, images, STATES)
