"""Scores of a detector's answers to the street images of a benchmark: average precision, differences of CFAs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from ..base.errors import DataError, ValidationIssue, nearest
from ..results.output import Output
from ..results.tables import VISION
from ..vision.detections import ALL, precision_scores, precisions
from ..vision.lamps import TEST
from ..vision.street import draw_streets, street_labels
from .score import issue_of, table_of

COLUMNS = ("image_id", "x_px", "y_px", "state", "score")


def is_of_streets(path: Path) -> bool:
    """Return whether a file of answers has positions.

    True for detections.
    """
    return "x_px" in table_of(path)


def labels_of_test(output: Output) -> pd.DataFrame:
    """Return the labels of a run's test images of streets.

    Returns a row per image, see `street_labels`.
    """
    vision = output.study.vision
    assert vision is not None
    assert vision.street is not None
    designs = output.vision[VISION][["design_id", "name", "cfa"]].drop_duplicates().to_dict("records")
    tables = []
    for number in range(vision.seeds):
        scenes = draw_streets(vision, vision.street, TEST, (output.study.seed, number))
        for design in designs:
            key, mosaic = {str(name): value for name, value in design.items()}, output.mosaic(design["cfa"])
            tables.append(street_labels(vision, mosaic, scenes, key | {"seed": number}, TEST))
    return pd.concat(tables, ignore_index=True)


def read_detections(path: Path, labels: pd.DataFrame, lenses: Sequence[str]) -> pd.DataFrame:
    """Read a file of detections: a row each, with `image_id`, `x_px`, `y_px`, `state` and `score`.

    `path`: CSV or Parquet; positions are from the center of the first pixel. Raises DataError for a file that cannot be
    read, other columns, images or states, and what is no number.
    """
    table = table_of(path)
    missing = [name for name in COLUMNS if name not in table]
    if missing:
        raise DataError(ValidationIssue("a column is missing", str(path), None, None, missing[0], ", ".join(COLUMNS)))
    issues = []
    ids, states = table["image_id"].astype(str), table["state"].astype(str)
    others, unknown = ids[~ids.isin(labels["image_id"])], states[~states.isin(lenses)]
    if len(others):
        issues.append(issue_of("not an image of a street of the test", path, others, "image_id"))
    if len(unknown):
        near = nearest(unknown.iloc[0], lenses)
        issues.append(issue_of("no signal type", path, unknown, "state", ", ".join(lenses), near))
    numbers = {name: pd.to_numeric(table[name], errors="coerce") for name in ("x_px", "y_px", "score")}
    for name, values in numbers.items():
        wrong = table[name][~np.isfinite(values)].astype(str)
        if len(wrong):
            issues.append(issue_of("no number", path, wrong, name, "a number"))
    if issues:
        raise DataError(issues)
    return pd.DataFrame({"image_id": ids, "state": states, **numbers})


def street_scores(reader: str, detections: pd.DataFrame, labels: pd.DataFrame, lenses: Sequence[str]) -> pd.DataFrame:
    """Score a detector: one row per design and light level, and all levels, with 95 % intervals over the seeds."""
    parts = [
        precisions(images, detections, lenses).assign(name=images["name"].iloc[0], seed=images["seed"].iloc[0])
        for _, images in labels.groupby(["name", "seed"], sort=False)
    ]
    scores = precision_scores(pd.concat(parts, ignore_index=True), str(labels["name"].iloc[0]))
    scores.insert(0, "reader", reader)
    return scores


def street_lines(scores: pd.DataFrame) -> Iterator[str]:
    """Yield a line per detector and design, over all light levels."""
    totals = scores[scores["level"] == ALL]
    first = totals["name"].iloc[0]
    for row in totals.to_dict("records"):
        text = f"{row['reader']}, {row['name']}: average precision {row['average_precision']:.3f}"
        text += f" ({row['average_precision_low']:.3f} to {row['average_precision_high']:.3f})"
        if row["name"] != first:
            note = "" if row["apart_low"] > 0 or row["apart_high"] < 0 else ", not told apart"
            text += f"; {row['apart']:+.3f} ({row['apart_low']:+.3f} to {row['apart_high']:+.3f}) against {first}{note}"
        yield f"{text}."
